#include "estimator/signal/stationarity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kSamplesACycle = 50.685;
constexpr int kSteps = 20;  // steps of the integration in a sample

struct Drive {
  double frequency_hz, amplitude, ramp_s;
  double at(double t) const {
    return amplitude * std::min(1.0, t / ramp_s) *
           std::cos((2.0 * std::numbers::pi) * frequency_hz * t);
  }
};

// Integrates u'' + force(u, u') = x from rest by Runge-Kutta; the first cycles are not
// recorded.
Recording simulated(const Drive& drive, const std::function<double(double, double)>& force,
                    double left_out, double cycles, double noise, unsigned seed) {
  std::mt19937_64 source(seed);
  std::normal_distribution<double> normal(0.0, noise);
  Recording r;
  r.name = "r1";
  r.frequency_hz = drive.frequency_hz;
  r.amplitude = drive.amplitude;
  const double step = 1.0 / (drive.frequency_hz * kSamplesACycle * kSteps);
  using State = std::array<double, 2>;
  const auto slope = [&](double t, const State& s) {
    return State{s[1], drive.at(t) - force(s[0], s[1])};
  };
  const auto moved = [](const State& s, const State& by, double h) {
    return State{s[0] + h * by[0], s[1] + h * by[1]};
  };
  State s{0.0, 0.0};
  for (int i = 0; i < static_cast<int>((left_out + cycles) * kSamplesACycle * kSteps); ++i) {
    const double t = i * step;
    if (i % kSteps == 0 && i >= left_out * kSamplesACycle * kSteps) {
      r.t.push_back(t);
      r.excitation.push_back(drive.at(t));
      r.displacement.push_back(s[0] + normal(source));
    }
    const State a = slope(t, s), b = slope(t + 0.5 * step, moved(s, a, 0.5 * step));
    const State c = slope(t + 0.5 * step, moved(s, b, 0.5 * step));
    const State d = slope(t + step, moved(s, c, step));
    for (std::size_t k = 0; k < 2; ++k)
      s[k] += step / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
  }
  return r;
}

// A mode of 1.42 Hz that is driven at 3 Hz alternates from cycle to cycle while it decays.
TEST(Stationarity, CallsRingingOfALightlyDampedModeNoSubharmonic) {
  const auto linear = [](double u, double v) { return 1.6 * v + 80.0 * u; };
  for (unsigned draw = 0; draw < 20; ++draw) {
    const auto run = steady_cycles(simulated({3.0, 2.0, 0.5}, linear, 0.0, 17.37, 2e-5, draw));
    ASSERT_TRUE(run) << run.error().what;
    EXPECT_EQ(run->subharmonic, 0) << draw;
  }
}

// The Duffing oscillator with two wells, at amplitudes with a response of two periods.
TEST(Stationarity, SeesAPeriodThatHasDoubled) {
  const auto duffing = [](double u, double v) { return 0.3 * v - u + u * u * u; };
  for (const double amplitude : {0.28, 0.65}) {
    for (const double cycles : {8.4, 20.4}) {
      const auto run = steady_cycles(simulated({1.2 / (2.0 * std::numbers::pi), amplitude, 10.0},
                                               duffing, 60.0, cycles, 1e-3, 4));
      ASSERT_TRUE(run) << run.error().what;
      EXPECT_EQ(run->subharmonic, 2) << amplitude << ", " << cycles;
      EXPECT_FALSE(run->dying) << amplitude << ", " << cycles;
    }
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
