// One browser's queue of events. Bounded: a browser that does not read is given up.
//
// What it was owed when it came does not count against the bound. One thread.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "gateway/feed.hpp"

namespace shaker::gateway {

class Browser {
 public:
  Browser(std::size_t max_waiting, const std::vector<Event>& opening);

  // Returns false if more waits for it than is allowed: it is to be given up. An event that can
  // be dropped is dropped when a tenth of that waits.
  bool offer(const Event& event);
  // Copies what waits, at most `size` bytes, and forgets it. Returns the number of bytes.
  std::size_t read(char* to, std::size_t size);
  bool empty() const { return queue_.empty(); }
  std::size_t waiting() const { return bytes_; }

 private:
  std::deque<Text> queue_;
  std::size_t sent_of_first_ = 0, bytes_ = 0, max_waiting_, owed_ = 0;
};

}  // namespace shaker::gateway
