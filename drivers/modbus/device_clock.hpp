// From the time stamp that a device puts beside its samples to the daemon's monotonic time.
//
// A sample that is stamped when the host polls it carries the poll's latency as an error in time,
// which a moving stroke turns into noise. The device's own stamp has none, but its clock has
// another zero, another rate, and wraps. What is known: a sample is never received before it was
// taken. So the difference "received - device time" lies above a slowly moving line, touches it
// whenever a poll was quick, and that lower envelope is the difference of the clocks (but for the
// shortest latency, a constant). Rates may differ by 1000 ppm. Source: Moon, Skelly, Towsley,
// "Estimation and removal of clock skew from network delay measurements", INFOCOM 1999.
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
  // A counter of so many bits (at most 32) that counts so many nanoseconds each.
  struct Counter {
    int bits = 32;
    double tick_ns = 1e3;
  };
  explicit DeviceClock(Counter counter) : counter_(counter) {}

  // The link was lost: what comes may be another device, or the same one after a power cut.
  void restart() { synchronised_ = false; }

  // Once for each poll that was answered: sent at `asked`, answered at `received`. nullopt when
  // `raw` is the stamp of the sample before: nothing new. Otherwise when the sample was taken:
  // later than the one before, not later than `received`. A stamp that does not fit into the time
  // between the two polls (the device's clock was set, the device restarted) begins anew with
  // `received`.
  std::optional<Nanoseconds> stamp(std::uint32_t raw, Nanoseconds asked, Nanoseconds received);

  // So often did it begin, the first time included.
  std::uint64_t beginnings() const { return beginnings_; }

 private:
  // Since the beginning, ns: the device's time, and received - device time.
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
  double device_ = 0.0;   // ns since the beginning
  double applied_ = 0.0;  // offset in use, ns
  double slope_ = 0.0;    // of it, per ns
  double bucket_ = 0.0, bucket_end_ = 0.0;
  std::array<Point, kWindow> points_{};  // the quickest poll of each bucket, a ring
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace shaker::drivers::modbus
