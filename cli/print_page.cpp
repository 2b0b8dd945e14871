#include "cli/print_page.hpp"

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <spawn.h>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

extern char** environ;

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kLongestPrint{60};
constexpr std::chrono::milliseconds kLookAgain{20};

// The first of the directories in PATH that has it; empty if none has.
fs::path program_called(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::string rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    const fs::path candidate = fs::path(rest.substr(0, colon)) / name;
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
  return {};
}

// The exit status of a program without input and output; -1: it did not start, or not end in time.
int status_of(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words)
    arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t silent;
  posix_spawn_file_actions_init(&silent);
  posix_spawn_file_actions_addopen(&silent, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&silent, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&silent, 2, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int started =
      ::posix_spawn(&child, words[0].c_str(), &silent, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&silent);
  if (started != 0) return -1;
  const auto end = std::chrono::steady_clock::now() + kLongestPrint;
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > end) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
      return -1;
    }
    std::this_thread::sleep_for(kLookAgain);
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

Result<void> print_page(const fs::path& html, const fs::path& pdf) {
  std::vector<std::string> words;
  std::error_code none;
  const fs::path profile = pdf.string() + ".profile";
  if (const fs::path found = program_called("weasyprint"); !found.empty())
    words = {found.string(), html.string(), pdf.string()};
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    const fs::path found = words.empty() ? program_called(name) : fs::path();
    if (found.empty()) continue;
    words = {found.string(),
             "--headless",
             "--disable-gpu",
             "--no-pdf-header-footer",
             "--user-data-dir=" + fs::absolute(profile).string(),
             "--print-to-pdf=" + fs::absolute(pdf).string(),
             "file://" + fs::absolute(html).string()};
    // Chromium's own sandbox does not start as root.
    if (::geteuid() == 0) words.insert(words.begin() + 1, "--no-sandbox");
  }
  if (words.empty())
    return Error{
        ErrorKind::unavailable,
        fmt::format("{}: a PDF needs weasyprint or Chromium, and neither is installed; give "
                    "a name that ends in .html",
                    pdf.string())};
  const int status = status_of(words);
  fs::remove_all(profile, none);
  if (status == 0 && fs::exists(pdf, none)) return {};
  return Error{ErrorKind::io, fmt::format("{}: {} did not print it; give a name that ends in .html",
                                          pdf.string(), words[0])};
}

}  // namespace shaker::cli
