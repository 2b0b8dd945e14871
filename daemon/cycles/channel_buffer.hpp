// Ring buffer with the last few periods of one channel, in order of time. Allocates in reset()
// only; a push writes two words.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "base/clock.hpp"

namespace shaker::daemon {

class ChannelBuffer {
 public:
  struct Point {
    Nanoseconds t{};
    double value = 0.0;
  };

  // Clears the buffer; from now on it keeps at least `capacity` points.
  void reset(std::size_t capacity) {
    points_.assign(std::bit_ceil(capacity < 64 ? std::size_t{64} : capacity), {});
    count_ = 0;
  }
  // Precondition: reset() was called. Returns false, and drops the point, if `t` does not
  // increase.
  bool push(Nanoseconds t, double value) {
    if (count_ > 0 && t <= latest()) return false;
    points_[count_++ & (points_.size() - 1)] = {t, value};
    return true;
  }
  bool empty() const { return count_ == 0; }
  Nanoseconds latest() const { return points_[(count_ - 1) & (points_.size() - 1)].t; }

  // The points that are kept have the numbers [first(), end()). Numbers increase without limit.
  std::uint64_t first() const { return count_ > points_.size() ? count_ - points_.size() : 0; }
  std::uint64_t end() const { return count_; }
  const Point& operator[](std::uint64_t number) const {
    return points_[number & (points_.size() - 1)];
  }
  // Number of the first point at or after t.
  std::uint64_t find(Nanoseconds t) const {
    std::uint64_t low = first(), high = end();
    while (low < high) {
      const auto middle = low + (high - low) / 2;
      (*this)[middle].t < t ? low = middle + 1 : high = middle;
    }
    return low;
  }

 private:
  std::vector<Point> points_;
  std::uint64_t count_ = 0;
};

}  // namespace shaker::daemon
