// Converts the kernel's receive stamp (CLOCK_REALTIME) to the daemon's monotonic time.
//
// The wall clock may be stepped between the arrival of a frame and its reading, and is slewed
// all the time. Therefore the difference of the clocks is measured for each batch of frames. A
// stamp is valid only if it lies between the newest one before and now. Otherwise the
// difference of the batch before is tried, and finally the time of reading is used. Stamps
// never run backwards. One thread; does not allocate.
#pragma once

#include <cstdint>

#include "base/clock.hpp"

namespace shaker::drivers::can {

// The two clocks at one moment.
struct ClockPair {
  Nanoseconds monotonic{};
  Nanoseconds utc{};
};

// The most accurate of three attempts, each bracketed by the monotonic clock.
ClockPair read_pair(const Clock& clock);

class StampConverter {
 public:
  // Frames that arrived before `now` are not converted.
  void restart(ClockPair now);
  // Call once for each batch, after it was received and before it is converted.
  void update(ClockPair now);
  // `utc` is the kernel's stamp; zero if there is none.
  Nanoseconds convert(Nanoseconds utc);

  // Number of stamps that were missing or implausible and were replaced by the time of reading.
  std::uint64_t replaced() const { return replaced_; }

 private:
  ClockPair previous_, current_;
  Nanoseconds newest_{};
  std::uint64_t replaced_ = 0;
};

}  // namespace shaker::drivers::can
