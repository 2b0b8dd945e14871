// The connection to the daemon, on a thread of its own, so that no browser waits for it and it
// waits for no browser.
//
// Connects, subscribes to the documents for those who look on, and hands over every line. A
// connection that is lost, or silent for kSilenceMs (the daemon says something every second), is
// given up and tried again. It sends nothing but the subscription.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::gateway {

class DaemonLink {
 public:
  static constexpr int kSilenceMs = 3000;
  static constexpr int kRetryMs = 500;
  static constexpr std::size_t kMaxWaiting = 16 * 1024 * 1024;  // bytes not yet taken

  // Starts at once. Throws std::system_error without file descriptors.
  explicit DaemonLink(std::filesystem::path socket);
  ~DaemonLink();

  struct News {
    enum class Kind { connected, line, lost };
    Kind kind = Kind::line;
    std::string text;  // the line; why it was lost
  };
  int fd() const { return wake_.get(); }  // readable when there is news
  std::deque<News> take();

 private:
  void work(const std::stop_token& stop);
  Result<void> follow(const std::stop_token& stop);
  bool tell(News::Kind kind, std::string text = {});

  std::filesystem::path socket_;
  UniqueFd wake_;
  std::mutex mutex_;
  std::condition_variable_any pause_;
  std::deque<News> news_;
  std::size_t waiting_ = 0;
  std::jthread thread_;  // last
};

}  // namespace shaker::gateway
