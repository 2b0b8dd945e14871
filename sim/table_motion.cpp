#include "sim/table_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shaker::sim {

TableMotion::TableMotion(double rate, std::array<double, 4> harmonics, double gain, double drift)
    : rate_(rate),
      harmonics_(harmonics),
      pure_(std::ranges::all_of(harmonics, [](double h) { return h == 0.0; })),
      gain_(gain),
      drift_(drift) {}

void TableMotion::go_to(double t, double frequency_hz, double amplitude_now, double ramp) {
  const double a = amplitude(t);
  const double f = frequency(t);
  const bool from_rest = a == 0.0;
  // Kept within one turn, so that a long run loses no digits.
  phase0_ = from_rest ? 0.0 : std::remainder(phase(t), 2.0 * std::numbers::pi);
  f0_ = from_rest ? frequency_hz : f;
  a0_ = a;
  f1_ = frequency_hz;
  a1_ = amplitude_now;
  ramp_ = std::max(ramp, 0.0);
  t0_ = t;
}

double TableMotion::frequency(double t) const {
  const double s = elapsed(t);
  return s >= ramp_ ? f1_ : f0_ + (f1_ - f0_) * s / ramp_;
}

double TableMotion::amplitude(double t) const {
  const double s = elapsed(t);
  return s >= ramp_ ? a1_ : a0_ + (a1_ - a0_) * s / ramp_;
}

double TableMotion::phase(double t) const {
  const double s = elapsed(t);
  const double turns = s >= ramp_ ? 0.5 * (f0_ + f1_) * ramp_ + f1_ * (s - ramp_)
                                  : s * (f0_ + 0.5 * (f1_ - f0_) * s / ramp_);
  return phase0_ + 2.0 * std::numbers::pi * turns;
}

double TableMotion::acceleration(double t) const {
  const double a = moved(t);
  if (a == 0.0) return 0.0;
  const double angle = phase(t);
  double wave = std::cos(angle);
  if (!pure_) {
    for (std::size_t i = 0; i < harmonics_.size(); ++i) {
      wave += harmonics_[i] * std::cos(static_cast<double>(i + 2) * angle);
    }
  }
  return a * wave;
}

double TableMotion::fundamental(double t, double lag) const {
  return moved(t) * std::cos(phase(t) - lag);
}

double TableMotion::velocity(double t) const {
  const double omega = 2.0 * std::numbers::pi * frequency(t) * rate_;
  if (amplitude(t) == 0.0 || omega <= 0.0) return 0.0;
  const double angle = phase(t);
  double wave = std::sin(angle);
  for (std::size_t i = 0; i < harmonics_.size(); ++i) {
    const double k = static_cast<double>(i + 2);
    wave += harmonics_[i] * std::sin(k * angle) / k;
  }
  return moved(t) / omega * wave;
}

double TableMotion::position(double t) const {
  const double omega = 2.0 * std::numbers::pi * frequency(t) * rate_;
  if (amplitude(t) == 0.0 || omega <= 0.0) return 0.0;
  const double angle = phase(t);
  double wave = std::cos(angle);
  for (std::size_t i = 0; i < harmonics_.size(); ++i) {
    const double k = static_cast<double>(i + 2);
    wave += harmonics_[i] * std::cos(k * angle) / (k * k);
  }
  return -moved(t) / (omega * omega) * wave;
}

}  // namespace shaker::sim
