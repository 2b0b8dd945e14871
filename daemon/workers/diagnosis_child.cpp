#include "daemon/workers/diagnosis_child.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <spawn.h>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace shaker::daemon {
namespace {

constexpr std::size_t kMostOutput = std::size_t{16} << 20U;       // bytes
constexpr int kReadWait = 50, kOwnEnd = 1000, kKilledEnd = 2000;  // ms

Error failed(const char* what, int reason) {
  return Error{ErrorKind::io, fmt::format("The diagnosis was not started: {} failed ({}).", what,
                                          std::strerror(reason))};
}

// Puts the job into a file in memory, so that writing it never waits for the reader.
Result<UniqueFd> file_of(const std::string& job) {
  UniqueFd file(::memfd_create("diagnosis", MFD_CLOEXEC));
  if (!file.valid()) return failed("memfd_create", errno);
  if (::write(file.get(), job.data(), job.size()) != static_cast<ssize_t>(job.size()))
    return failed("write", errno);
  ::lseek(file.get(), 0, SEEK_SET);
  return file;
}

// Returns 0 or an errno. Acts like vfork and exec: the daemon's memory is not copied.
int spawn(const std::filesystem::path& program, int input, int output, pid_t& process) {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t how;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawnattr_init(&how);
  ::posix_spawn_file_actions_adddup2(&files, input, 0);
  ::posix_spawn_file_actions_adddup2(&files, output, 1);
  ::posix_spawn_file_actions_addclosefrom_np(&files, 3);
  sigset_t none, all;
  ::sigemptyset(&none);
  ::sigfillset(&all);
  ::posix_spawnattr_setsigmask(&how, &none);
  ::posix_spawnattr_setsigdefault(&how, &all);
  ::posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::string name = program.string(), command = "diagnose", job = "--job";
  std::array<char*, 4> words = {name.data(), command.data(), job.data(), nullptr};
  const int trouble = ::posix_spawn(&process, name.c_str(), &files, &how, words.data(), environ);
  ::posix_spawnattr_destroy(&how);
  ::posix_spawn_file_actions_destroy(&files);
  return trouble;
}

}  // namespace

Result<DiagnosisChild> DiagnosisChild::start(const std::vector<std::filesystem::path>& places,
                                             const std::string& job) {
  const auto input = file_of(job);
  if (!input) return input.error();
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return failed("pipe", errno);
  UniqueFd output(ends[0]);
  const UniqueFd written(ends[1]);
  ::fcntl(output.get(), F_SETFL, O_NONBLOCK);
  int reason = ENOENT;
  for (const auto& program : places) {
    pid_t process = -1;
    const int trouble = spawn(program, input->get(), written.get(), process);
    if (trouble == 0) return DiagnosisChild(process, std::move(output));
    if (trouble != ENOENT) reason = trouble;
  }
  return Error{ErrorKind::unavailable,
               fmt::format("The program of the diagnosis, {}, cannot be started ({}); in a clone, "
                           "build it with `ninja -C build`, else install the package again.",
                           places.front().string(), std::strerror(reason))};
}

DiagnosisChild::DiagnosisChild(DiagnosisChild&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      output_(std::move(other.output_)),
      line_(std::move(other.line_)),
      total_(other.total_) {}

DiagnosisChild::~DiagnosisChild() {
  if (process_ < 0) return;
  int status = 0;
  ::kill(process_, SIGKILL);
  ended_within(kKilledEnd, status);
}

Result<bool> DiagnosisChild::read(const std::function<void(const std::string& line)>& take) {
  pollfd readable{output_.get(), POLLIN, 0};
  if (::poll(&readable, 1, kReadWait) <= 0) return true;
  std::array<char, 16384> bytes{};
  const ssize_t count = ::read(output_.get(), bytes.data(), bytes.size());
  if (count < 0) return errno == EAGAIN || errno == EINTR;
  if (count == 0) return false;
  total_ += static_cast<std::size_t>(count);
  if (total_ > kMostOutput)
    return Error{ErrorKind::exhausted,
                 "The diagnosis failed: its program wrote more than a diagnosis can be."};
  for (const char c : std::string_view(bytes.data(), static_cast<std::size_t>(count))) {
    if (c != '\n') {
      line_ += c;
    } else {
      take(std::exchange(line_, {}));
    }
  }
  return true;
}

std::string DiagnosisChild::end() {
  int status = 0;
  if (!ended_within(kOwnEnd, status)) {
    ::kill(process_, SIGKILL);
    if (!ended_within(kKilledEnd, status)) return "no end, not even by SIGKILL";
  }
  if (WIFSIGNALED(status))
    return fmt::format("signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
  return fmt::format("status {}", WEXITSTATUS(status));
}

bool DiagnosisChild::ended_within(int milliseconds, int& status) {
  using namespace std::chrono;
  const auto until = steady_clock::now() + std::chrono::milliseconds(milliseconds);
  while (true) {
    const pid_t ended = ::waitpid(process_, &status, WNOHANG);
    if (ended == process_ || (ended < 0 && errno != EINTR)) break;
    if (steady_clock::now() > until) return false;
    std::this_thread::sleep_for(2ms);
  }
  process_ = -1;
  return true;
}

}  // namespace shaker::daemon
