// State of one channel: quality and age always; rate, level and noise at rest.
//
// A channel is "good" only after its first good sample. One thread; add() neither allocates nor
// blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/clock.hpp"
#include "drivers/sensor.hpp"

namespace shaker::daemon {

class ChannelMonitor {
 public:
  // Returns true if the sample is good: flagged good, finite, and later than the good one
  // before.
  bool add(const drivers::Sample& sample) {
    ++all_;
    quality_ = std::isfinite(sample.value) ? sample.quality : drivers::Quality::bad;
    if (quality_ != drivers::Quality::good || (good_ > 0 && sample.t <= last_good_)) {
      ++bad_;
      return false;
    }
    if (good_ == 0 || sample.value != value_) changed_ = sample.t;
    if (rest_count_ == 0) {
      rest_begin_ = sample.t;
      rest_base_ = sample.value;
    }
    const double v = sample.value - rest_base_;
    ++rest_count_;
    rest_sum_ += v;
    rest_square_ += v * v;
    ++good_;
    last_good_ = sample.t;
    value_ = sample.value;
    return true;
  }

  bool seen() const { return all_ > 0; }
  bool ever_good() const { return good_ > 0; }
  drivers::Quality quality() const { return quality_; }
  Nanoseconds last_good() const { return last_good_; }
  Nanoseconds last_change() const { return changed_; }
  double value() const { return value_; }
  std::uint64_t all() const { return all_; }

  // --- statistics since the last begin_rest()
  void begin_rest() {
    rest_count_ = 0;
    rest_sum_ = rest_square_ = 0.0;
    bad_before_ = bad_;
  }
  std::uint64_t rest_count() const { return rest_count_; }
  std::uint64_t rest_bad() const { return bad_ - bad_before_; }
  double rest_rate_hz() const {
    const double span = seconds(last_good_ - rest_begin_);
    return rest_count_ > 1 && span > 0.0 ? static_cast<double>(rest_count_ - 1) / span : 0.0;
  }
  double rest_noise() const {
    if (rest_count_ < 2) return 0.0;
    const double n = static_cast<double>(rest_count_);
    return std::sqrt(std::max(0.0, (rest_square_ - rest_sum_ * rest_sum_ / n) / (n - 1.0)));
  }

 private:
  drivers::Quality quality_ = drivers::Quality::bad;
  std::uint64_t all_ = 0, good_ = 0, bad_ = 0, bad_before_ = 0, rest_count_ = 0;
  Nanoseconds last_good_{}, changed_{}, rest_begin_{};
  double value_ = 0.0, rest_base_ = 0.0, rest_sum_ = 0.0, rest_square_ = 0.0;
};

}  // namespace shaker::daemon
