#include "drivers/can/bus_watch.hpp"

#include <algorithm>

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;
using protocol::can::Frame;

constexpr Nanoseconds kLeastPatience = 200ms;
constexpr Nanoseconds kQueued = 1s;  // an old frame may wait this long for the bus
constexpr Nanoseconds kWindow = 500ms;
constexpr double kCrowdedPart = 1.5;

bool same(const Frame& a, const Frame& b) {
  return a.remote == b.remote && a.fd == b.fd && std::ranges::equal(a.bytes(), b.bytes());
}

}  // namespace

BusWatch::BusWatch(Nanoseconds setpoint_period, std::optional<double> status_period_s)
    : patience_(std::max(kLeastPatience, 5 * setpoint_period)) {
  if (status_period_s && *status_period_s > 0.0)
    allowed_ = kCrowdedPart * seconds(kWindow) / *status_period_s + 1.0;
}

void BusWatch::sending(const Frame& frame, Nanoseconds now) {
  if (!active_) {
    last_heard_ = now;
    looks_ = 0;
  }
  silent(now);
  sent_[count_++ % kRemembered] = {frame, Nanoseconds::max()};
  active_ = true;
  heard_ = false;
}

void BusWatch::silent(Nanoseconds now) {
  if (active_) sent_[(count_ - 1) % kRemembered].replaced = now;
  active_ = false;
}

bool BusWatch::is_ours(const Frame& frame, Nanoseconds t) {
  for (std::size_t back = 1; back <= std::min(count_, kRemembered); ++back) {
    const Sent& sent = sent_[(count_ - back) % kRemembered];
    if (t - kQueued > sent.replaced) break;  // and the ones before it were replaced earlier
    if (!same(sent.frame, frame)) continue;
    heard_ = heard_ || (active_ && back == 1);
    last_heard_ = std::max(last_heard_, t);
    looks_ = 0;
    return true;
  }
  return false;
}

bool BusWatch::unheard(Nanoseconds now) {
  if (!active_) return false;
  ++looks_;
  return looks_ >= kLooks && now - last_heard_ > patience_;
}

void BusWatch::on_status(Nanoseconds t) {
  if (!allowed_) return;
  if (t - window_began_ >= kWindow) {
    const bool crowded = in_window_ > *allowed_;
    crowded_ = crowded && t - window_began_ < 2 * kWindow ? crowded_ + 1 : 0;
    window_began_ = t;
    in_window_ = 0;
  }
  ++in_window_;
}

}  // namespace shaker::drivers::can
