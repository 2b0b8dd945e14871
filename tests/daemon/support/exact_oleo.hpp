// The oleo of the reference case, integrated by Runge-Kutta with 20 000 steps per period until
// it repeats. It is an independent reference for the cycle code.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace shaker::testing {

class ExactOleo {
 public:
  ExactOleo(double frequency_hz, double amplitude) : f_(frequency_hz), a_(amplitude) {
    double u = 0.16, v = 0.0;
    const double h = 1.0 / (f_ * kSteps);
    stroke_.resize(kSteps);
    for (int period = 0; period < 60; ++period) {
      for (int i = 0; i < kSteps; ++i) {
        stroke_[static_cast<std::size_t>(i)] = u;
        const double t = i * h;
        const double k1u = v, k1v = acceleration(t, u, v);
        const double k2u = v + h / 2 * k1v, k2v = acceleration(t + h / 2, u + h / 2 * k1u, k2u);
        const double k3u = v + h / 2 * k2v, k3v = acceleration(t + h / 2, u + h / 2 * k2u, k3u);
        const double k4u = v + h * k3v, k4v = acceleration(t + h, u + h * k3u, k4u);
        u += h / 6 * (k1u + 2 * k2u + 2 * k3u + k4u);
        v += h / 6 * (k1v + 2 * k2v + 2 * k3v + k4v);
      }
    }
    closure_ = std::abs(u - stroke_[0]);
  }

  // Stroke at cyclic time tau (periodic), by four-point interpolation.
  double stroke(double tau) const {
    const double x = (tau - std::floor(tau)) * kSteps;
    const int i = static_cast<int>(x);
    const double s = x - i;
    const auto at = [&](int k) { return stroke_[static_cast<std::size_t>((k + kSteps) % kSteps)]; };
    return at(i - 1) * (-s * (s - 1) * (s - 2) / 6) + at(i) * ((s + 1) * (s - 1) * (s - 2) / 2) +
           at(i + 1) * (-(s + 1) * s * (s - 2) / 2) + at(i + 2) * ((s + 1) * s * (s - 1) / 6);
  }
  double excitation(double tau) const { return a_ * std::cos(2.0 * std::numbers::pi * tau); }
  double closure() const { return closure_; }  // by how much the last period does not close, m

 private:
  static constexpr int kSteps = 20000;
  double acceleration(double t, double u, double v) const {
    return 9.80665 + a_ * std::cos(2.0 * std::numbers::pi * f_ * t) - 16.6667 * std::abs(v) * v -
           1.524 / (1.0 - 5.31496 * u);
  }
  double f_, a_, closure_ = 0.0;
  std::vector<double> stroke_;
};

}  // namespace shaker::testing
