// Wakes a loop from another thread. Many wakes before one `clear` cost one system call.
#pragma once

#include <atomic>

#include "base/unique_fd.hpp"

namespace shaker::daemon {

class Waker {
 public:
  Waker();                // throws std::system_error
  void wake() noexcept;   // any thread; neither blocks nor allocates
  void clear() noexcept;  // called by the loop before it examines its inputs
  int fd() const { return fd_.get(); }

 private:
  UniqueFd fd_;
  std::atomic<bool> awake_{false};
};

}  // namespace shaker::daemon
