// Waves on their way to the clients' loop. Those who measure and fit put them in, the clients'
// loop takes them out. The engine's thread never calls it, so that nobody who looks on can
// delay it. Holds the newest kMaxWaves; any thread.
#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <utility>

#include "protocol/documents.hpp"

namespace shaker::daemon {

class WaveBox {
 public:
  static constexpr std::size_t kMaxWaves = 16;

  void put(protocol::WaveDocument wave) {
    const std::lock_guard lock(mutex_);
    waves_.push_back(std::move(wave));
    if (waves_.size() > kMaxWaves) waves_.pop_front();
  }
  std::deque<protocol::WaveDocument> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(waves_, {});
  }

 private:
  std::mutex mutex_;
  std::deque<protocol::WaveDocument> waves_;
};

}  // namespace shaker::daemon
