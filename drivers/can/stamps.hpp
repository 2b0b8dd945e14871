// From the kernel's receive stamp (CLOCK_REALTIME) to the daemon's monotonic time.
//
// The wall clock may be stepped between a frame's arrival and its reading, and is slewed all the
// time. So the difference between the clocks is measured anew for each batch of frames, and a stamp
// counts only if it lies between the newest one before and now; otherwise the difference of before
// the step is tried, and at last the time of reading is taken. Stamps never run backwards. One
// thread; does not allocate.
#pragma once

#include <cstdint>

#include "base/clock.hpp"

namespace shaker::drivers::can {

// The two clocks at one moment.
struct ClockPair {
  Nanoseconds monotonic{};
  Nanoseconds utc{};
};

// The tightest of three tries, each bracketed by the monotonic clock.
ClockPair read_pair(const Clock& clock);

class StampConverter {
 public:
  // Frames that arrived before `now` have not been received by us.
  void restart(ClockPair now);
  // Once before each batch is converted, after it has been received.
  void update(ClockPair now);
  // `utc` as the kernel stamped it; zero when it did not.
  Nanoseconds convert(Nanoseconds utc);

  // So many stamps were missing or implausible and were replaced by the time of reading.
  std::uint64_t replaced() const { return replaced_; }

 private:
  ClockPair previous_, current_;
  Nanoseconds newest_{};
  std::uint64_t replaced_ = 0;
};

}  // namespace shaker::drivers::can
