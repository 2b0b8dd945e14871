// Waits, for a bounded time, until a thread has done something.
#pragma once

#include <chrono>
#include <thread>

namespace shaker::daemon::testing {

template <class Condition>
bool eventually(Condition&& condition) {
  using namespace std::chrono_literals;
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(500us);
  }
  return true;
}

}  // namespace shaker::daemon::testing
