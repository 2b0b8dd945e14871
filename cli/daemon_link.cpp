#include "cli/daemon_link.hpp"

#include <cerrno>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <system_error>
#include <unistd.h>

#include "cli/stream_client.hpp"

namespace shaker::cli {
namespace {

constexpr int kLookMs = 200;  // between two looks whether to stop

}  // namespace

DaemonLink::DaemonLink(std::filesystem::path socket, std::string reader,
                       std::vector<std::string> documents)
    : socket_(std::move(socket)),
      reader_(std::move(reader)),
      documents_(std::move(documents)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!wake_.valid()) throw std::system_error(errno, std::generic_category(), "eventfd");
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

DaemonLink::~DaemonLink() {
  thread_.request_stop();
  thread_.join();
}

std::deque<DaemonLink::News> DaemonLink::take() {
  std::uint64_t count = 0;
  if (::read(wake_.get(), &count, sizeof count) < 0) return {};  // nothing new
  const std::lock_guard lock(mutex_);
  waiting_ = 0;
  return std::exchange(news_, {});
}

// Returns false if too much waits: whoever takes the news stands still.
bool DaemonLink::tell(News::Kind kind, std::string text) {
  {
    const std::lock_guard lock(mutex_);
    if (kind == News::Kind::line && waiting_ > kMaxWaiting) return false;
    waiting_ += text.size();
    news_.push_back({kind, std::move(text)});
  }
  const std::uint64_t one = 1;
  return ::write(wake_.get(), &one, sizeof one) == static_cast<ssize_t>(sizeof one);
}

void DaemonLink::work(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto followed = follow(stop);
    if (stop.stop_requested()) return;
    tell(News::Kind::lost, followed ? std::string() : followed.error().what);
    std::unique_lock lock(mutex_);
    pause_.wait_for(lock, stop, std::chrono::milliseconds(kRetryMs), [] { return false; });
  }
}

// Returns when the connection ends.
Result<void> DaemonLink::follow(const std::stop_token& stop) {
  auto client = StreamClient::connect(socket_);
  if (!client) return client.error();
  tell(News::Kind::connected);
  tell(News::Kind::line, client->version_line());
  if (!documents_.empty()) {
    const auto sent = client->send("subscribe", {{"documents", documents_}});
    if (!sent) return sent.error();
  }
  int silent_ms = 0;
  while (!stop.stop_requested()) {
    std::string line;
    const auto wait = client->next(kLookMs, line);
    if (!wait) return wait.error();
    if (*wait == StreamClient::Wait::line) {
      silent_ms = 0;
      if (!tell(News::Kind::line, std::move(line)))
        return Error{ErrorKind::exhausted,
                     fmt::format("{} did not keep up with the daemon.", reader_)};
    } else if ((silent_ms += kLookMs) >= kSilenceMs) {
      return Error{ErrorKind::timeout,
                   fmt::format("{}: shakerd has said nothing for {} s; it hangs, or this PC is "
                               "overloaded. Use the hardware stop if the table moves.",
                               socket_.string(), kSilenceMs / 1000)};
    }
  }
  return {};
}

}  // namespace shaker::cli
