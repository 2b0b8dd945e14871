// The connection to the daemon for a program that serves others, on a thread of its own: nobody
// whom that program serves waits for the daemon, and the daemon waits for none of them.
//
// Connects, subscribes to what was asked for, and hands over every line. A connection that is
// lost, or silent for kSilenceMs (the daemon says something every second), is given up and tried
// again. It sends nothing but the subscription.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::cli {

class DaemonLink {
 public:
  static constexpr int kSilenceMs = 3000;
  static constexpr int kRetryMs = 500;
  static constexpr std::size_t kMaxWaiting = 16 * 1024 * 1024;  // bytes not yet taken

  // Starts at once. `documents` are those to subscribe to ("wave", ...), `reader` is the subject
  // of sentences about whoever takes the news ("The gateway"). Throws std::system_error without
  // file descriptors.
  DaemonLink(std::filesystem::path socket, std::string reader,
             std::vector<std::string> documents = {});
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
  std::string reader_;
  std::vector<std::string> documents_;
  UniqueFd wake_;
  std::mutex mutex_;
  std::condition_variable_any pause_;
  std::deque<News> news_;
  std::size_t waiting_ = 0;
  std::jthread thread_;  // last
};

}  // namespace shaker::cli
