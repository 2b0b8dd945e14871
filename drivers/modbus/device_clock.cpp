#include "drivers/modbus/device_clock.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::drivers::modbus {
namespace {

constexpr double kMs = 1e6;
constexpr double kShortestBucket = 250.0 * kMs;  // ns
constexpr std::size_t kFewestForASlope = 12;     // 3 s; with fewer points the slope is zero
constexpr double kLongestBucket = 2000.0 * kMs;  // 40 of them: a busy PC may be late for seconds
constexpr double kSteepest = 1500e-6;            // 1000 ppm, and a margin for the estimate's error
// Time constant for a correction of the envelope, as a part of the time span of its points; but
// at least one second.
constexpr double kSmoothing = 0.2, kShortestSmoothing = 1000.0 * kMs;
constexpr double kSnap = 1.0 * kMs;      // larger corrections are applied at once
constexpr double kEarliest = 2.0 * kMs;  // no clock drifts so far between two samples
constexpr double kOldest = 250.0 * kMs;  // no device keeps a sample for longer

double cross(double ax, double ay, double bx, double by) {
  return ax * by - ay * bx;
}

}  // namespace

std::optional<Nanoseconds> DeviceClock::stamp(std::uint32_t raw, Nanoseconds asked,
                                              Nanoseconds received) {
  if (raw_ == raw) return std::nullopt;
  double step = 0.0;
  if (synchronised_) step = advance(raw, received);
  raw_ = raw;
  if (!synchronised_) {
    begin(received);
  } else {
    const auto offset = static_cast<double>((received - base_).count()) - device_;
    const double late = offset - (applied_ + slope_ * step);
    const auto answered_in = static_cast<double>((received - asked).count());
    if (step <= 0.0 || late < -kEarliest || late > answered_in + kOldest) {
      begin(received);
    } else {
      remember(offset);
      slope_ = slope();
      const double wanted = envelope(slope_);
      applied_ += slope_ * step;
      const double error = wanted - applied_;
      // At the beginning the weight is 1/n, the mean of the corrections, until the smoothing
      // time is over.
      const double smoothing =
          std::max(kShortestSmoothing, kSmoothing * (device_ - point(0).device));
      const double part = std::min(1.0, step / std::min(smoothing, device_));
      applied_ += std::abs(error) > kSnap ? error : part * error;
    }
  }
  received_ = received;
  const Nanoseconds taken = base_ + Nanoseconds(std::llround(device_ + applied_));
  newest_ = std::max(newest_ + Nanoseconds(1), std::min(taken, received));
  return newest_;
}

void DeviceClock::begin(Nanoseconds received) {
  synchronised_ = true;
  ++beginnings_;
  base_ = received;
  device_ = applied_ = slope_ = 0.0;
  first_ = count_ = 0;
  bucket_ = kShortestBucket;
  remember(0.0);
}

// Advances the device time. The number of wraps is the one that agrees best with our own clock.
double DeviceClock::advance(std::uint32_t raw, Nanoseconds received) {
  const double range = std::ldexp(1.0, counter_.bits);
  const double ours = static_cast<double>((received - received_).count()) / counter_.tick_ns;
  const double counted = static_cast<double>(raw) - static_cast<double>(*raw_);
  const double step = (counted + range * std::round((ours - counted) / range)) * counter_.tick_ns;
  device_ += step;
  return step;
}

void DeviceClock::remember(double offset) {
  if (count_ > 0 && device_ < bucket_end_) {
    Point& last = points_[(first_ + count_ - 1) % kWindow];
    if (offset < last.offset) last = {device_, offset};
    return;
  }
  if (count_ == kWindow && bucket_ < kLongestBucket) merge();
  bucket_end_ = device_ + bucket_;
  if (count_ == kWindow) {
    first_ = (first_ + 1) % kWindow;
    --count_;
  }
  points_[(first_ + count_) % kWindow] = {device_, offset};
  ++count_;
}

// Merges pairs of buckets, so that the same memory covers twice the time.
void DeviceClock::merge() {
  std::array<Point, kWindow> merged;
  for (std::size_t i = 0; i < kWindow / 2; ++i) {
    const Point& a = point(2 * i);
    const Point& b = point(2 * i + 1);
    merged[i] = b.offset < a.offset ? b : a;
  }
  points_ = merged;
  first_ = 0;
  count_ = kWindow / 2;
  bucket_ *= 2.0;
}

// Slope of the line that lies below all points and is nearest to them on average: the edge of
// their lower convex hull at their mean time.
double DeviceClock::slope() const {
  if (count_ < kFewestForASlope) return 0.0;
  std::array<std::size_t, kWindow> hull;
  std::size_t corners = 0;
  double middle = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Point& p = point(i);
    middle += p.device / static_cast<double>(count_);
    while (corners >= 2) {
      const Point& a = point(hull[corners - 2]);
      const Point& b = point(hull[corners - 1]);
      if (cross(b.device - a.device, b.offset - a.offset, p.device - a.device,
                p.offset - a.offset) > 0.0) {
        break;
      }
      --corners;
    }
    hull[corners++] = i;
  }
  std::size_t right = 1;
  while (right + 1 < corners && point(hull[right]).device < middle)
    ++right;
  const Point& a = point(hull[right - 1]);
  const Point& b = point(hull[right]);
  return std::clamp((b.offset - a.offset) / (b.device - a.device), -kSteepest, kSteepest);
}

// Present value of the highest line with this slope below all points.
double DeviceClock::envelope(double slope) const {
  double lowest = point(0).offset + slope * (device_ - point(0).device);
  for (std::size_t i = 1; i < count_; ++i) {
    const Point& p = point(i);
    lowest = std::min(lowest, p.offset + slope * (device_ - p.device));
  }
  return lowest;
}

}  // namespace shaker::drivers::modbus
