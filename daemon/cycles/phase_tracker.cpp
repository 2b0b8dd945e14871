#include "daemon/cycles/phase_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::daemon {
namespace {

// A larger innovation is a jump, not noise. The minimum, 0.7 degrees, is above the effect of
// noise on a phase and below a phase change that would be visible in the stroke as a transient.
constexpr double kJumpFloor = 0.002;
constexpr double kJumpSigmas = 10.0;

}  // namespace

void PhaseTracker::restart(double nominal_hz) {
  count_ = next_ = 0;
  frequency_ = nominal_hz;
  mean_t_ = mean_turns_ = scatter_ = 0.0;
}

void PhaseTracker::add(Nanoseconds t, double turns) {
  if (count_ == 0) {
    origin_ = t;
    next_ = 0;
    window_[next_++] = {0.0, turns};
    count_ = 1;
    fit();
    return;
  }
  const double predicted = turns_at(t);
  const double innovation = std::remainder(turns - predicted, 1.0);
  // With fewer than four observations the error of the nominal frequency (0.1 % a period) is
  // not a jump.
  const double allowed = std::max(count_ < 4 ? 0.02 : kJumpFloor, kJumpSigmas * scatter_);
  if (std::abs(innovation) > allowed) {
    // The count of turns continues, so that no cycle is repeated or lost.
    ++jumps_;
    count_ = next_ = 0;
    scatter_ = 0.0;
  }
  window_[next_] = {seconds(t - origin_), predicted + innovation};
  next_ = (next_ + 1) % kWindow;
  count_ = std::min(count_ + 1, kWindow);
  fit();
}

void PhaseTracker::revise(std::size_t back, double turns) {
  double& known = window_[(next_ + kWindow - 1 - back) % kWindow].turns;
  known += std::remainder(turns - known, 1.0);
  fit();
}

void PhaseTracker::fit() {
  double st = 0.0, sp = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    st += window_[i].t;
    sp += window_[i].turns;
  }
  mean_t_ = st / static_cast<double>(count_);
  mean_turns_ = sp / static_cast<double>(count_);
  if (count_ < 2) return;
  double stt = 0.0, stp = 0.0, spp = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const double dt = window_[i].t - mean_t_;
    // Relative to the last frequency, so that thousands of turns do not cost digits.
    const double dp = window_[i].turns - mean_turns_ - frequency_ * dt;
    stt += dt * dt;
    stp += dt * dp;
    spp += dp * dp;
  }
  const double slope = stp / stt;
  frequency_ += slope;
  scatter_ = count_ > 2
                 ? std::sqrt(std::max(0.0, spp - slope * stp) / static_cast<double>(count_ - 2))
                 : 0.0;
}

double PhaseTracker::turns_at(Nanoseconds t) const {
  return mean_turns_ + frequency_ * (seconds(t - origin_) - mean_t_);
}

Nanoseconds PhaseTracker::time_of(double turns) const {
  return origin_ + from_seconds(mean_t_ + (turns - mean_turns_) / frequency_);
}

}  // namespace shaker::daemon
