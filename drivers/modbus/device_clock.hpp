// Converts the time stamp that a device adds to its samples to the daemon's monotonic time.
//
// If the host stamps a sample when it polls, the latency of the poll is an error in time, which
// a moving stroke turns into noise. The device's stamp has no such error, but its clock has
// another zero and rate, and wraps. A sample is never received before it was taken. Therefore
// the difference "received - device time" lies above a slowly moving line and touches it
// whenever a poll is fast. This lower envelope is the difference of the clocks (plus the
// shortest latency, a constant). The rates may differ by 1000 ppm. Source: Moon, Skelly,
// Towsley, "Estimation and removal of clock skew from network delay measurements", INFOCOM
// 1999.
//
// Pure, one thread, does not allocate.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "base/clock.hpp"

namespace shaker::drivers::modbus {

class DeviceClock {
 public:
  // Width of the counter in bits (at most 32) and duration of one tick in ns.
  struct Counter {
    int bits = 32;
    double tick_ns = 1e3;
  };
  explicit DeviceClock(Counter counter) : counter_(counter) {}

  // The link was lost: the next device may be another one, or the same one after a power
  // failure.
  void restart() { synchronised_ = false; }

  // Call once for each answered poll, sent at `asked` and answered at `received`. Returns
  // nullopt if `raw` is the stamp of the sample before, so that there is no new one. Otherwise
  // returns the time of the sample: after the one before and not after `received`. If a stamp
  // does not fit between the two polls (the device's clock was set, or the device restarted),
  // the conversion restarts at `received`.
  std::optional<Nanoseconds> stamp(std::uint32_t raw, Nanoseconds asked, Nanoseconds received);

  // Number of starts, with the first one.
  std::uint64_t beginnings() const { return beginnings_; }

 private:
  // Since the start, ns: the device's time, and received - device time.
  struct Point {
    double device = 0.0;
    double offset = 0.0;
  };
  static constexpr std::size_t kWindow = 40;

  void begin(Nanoseconds received);
  double advance(std::uint32_t raw, Nanoseconds received);
  void remember(double offset);
  void merge();
  double slope() const;
  double envelope(double slope) const;
  const Point& point(std::size_t i) const { return points_[(first_ + i) % kWindow]; }

  Counter counter_;
  std::optional<std::uint32_t> raw_;
  bool synchronised_ = false;
  std::uint64_t beginnings_ = 0;
  Nanoseconds base_{}, received_{}, newest_{};
  double device_ = 0.0;   // ns since the start
  double applied_ = 0.0;  // offset in use, ns
  double slope_ = 0.0;    // of the offset, per ns
  double bucket_ = 0.0, bucket_end_ = 0.0;
  std::array<Point, kWindow> points_{};  // fastest poll of each bucket; a ring buffer
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace shaker::drivers::modbus
