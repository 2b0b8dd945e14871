#include "daemon/safety/rest_watch.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::daemon {
namespace {

constexpr Nanoseconds kBin = std::chrono::milliseconds(10);
constexpr Nanoseconds kForget = std::chrono::milliseconds(250);  // a longer gap restarts the window

}  // namespace

void RestWatch::add(Nanoseconds t, double value) {
  if (count_ > 0 && t - bin_begin_ > kForget) {
    count_ = 0;
    filled_ = next_ = 0;
    moves_ = false;
  } else if (count_ > 0 && t - bin_begin_ >= kBin) {
    close_bin();
  }
  if (count_ == 0) {
    bin_begin_ = t;
    sum_ = square_ = 0.0;
  }
  if (!origin_) origin_ = value;
  const double v = value - *origin_;
  sum_ += v;
  square_ += v * v;
  ++count_;
}

void RestWatch::close_bin() {
  bins_[next_] = {sum_ / count_, square_ / count_};
  begins_[next_] = bin_begin_;
  next_ = (next_ + 1) % kBins;
  if (filled_ < kBins) ++filled_;
  count_ = 0;
  oldest_ = begins_[filled_ < kBins ? 0 : next_];
  double mean = 0.0, square = 0.0;
  for (std::size_t i = 0; i < filled_; ++i)
    mean += bins_[i].mean / static_cast<double>(filled_);
  std::size_t far = 0;
  for (std::size_t i = 0; i < filled_; ++i) {
    const double off = bins_[i].square - mean * (2.0 * bins_[i].mean - mean);
    square += std::max(0.0, off);
    if (off > limit_ * limit_) ++far;
  }
  level_ = std::sqrt(square / static_cast<double>(filled_));
  moves_ = knows_rest() && far >= kMovingBins;
}

}  // namespace shaker::daemon
