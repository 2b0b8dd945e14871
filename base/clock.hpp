// Clocks for all code that waits or stamps.
//
// The real clock is CLOCK_MONOTONIC; with the simulated one a day's campaign runs in seconds in
// one process. Times are nanoseconds since an arbitrary origin (boot for the real clock); UTC
// is only for people and files.
#pragma once

#include <chrono>
#include <string>

namespace shaker {

using Nanoseconds = std::chrono::nanoseconds;

inline double seconds(Nanoseconds t) {
  return std::chrono::duration<double>(t).count();
}
inline Nanoseconds from_seconds(double s) {
  return std::chrono::duration_cast<Nanoseconds>(std::chrono::duration<double>(s));
}

// Thread-safe. `now` neither blocks nor allocates.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual Nanoseconds now() const = 0;  // monotonic
  virtual Nanoseconds utc() const = 0;  // since 1970-01-01T00:00:00Z
  virtual void sleep_until(Nanoseconds monotonic) = 0;
};

class RealClock final : public Clock {
 public:
  Nanoseconds now() const override;
  Nanoseconds utc() const override;
  void sleep_until(Nanoseconds monotonic) override;
};

// Advances only by advance() or when a caller sleeps on it. For one thread.
class SimulatedClock final : public Clock {
 public:
  explicit SimulatedClock(Nanoseconds utc_at_start = std::chrono::seconds(1'700'000'000))
      : utc_at_start_(utc_at_start) {}
  Nanoseconds now() const override { return now_; }
  Nanoseconds utc() const override { return utc_at_start_ + now_; }
  void sleep_until(Nanoseconds monotonic) override {
    if (monotonic > now_) now_ = monotonic;
  }
  void advance(Nanoseconds step) { now_ += step; }

 private:
  Nanoseconds now_{0};
  Nanoseconds utc_at_start_;
};

// RFC 3339 with milliseconds, e.g. "2026-03-01T12:00:00.123Z".
std::string format_utc(Nanoseconds utc);

}  // namespace shaker
