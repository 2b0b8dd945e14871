#include "estimator/signal/phase_drift.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

TEST(PhaseDrift, TellsTheFrequencyOfANoisyRecord) {
  constexpr double kFullTurn = 2.0 * std::numbers::pi;
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<double> t, x;
  for (int i = 0; i < 5000; ++i) {
    t.push_back(0.37 + i / 733.0);
    x.push_back(0.5 + std::cos(kFullTurn * 4.002 * t.back() - 1.0) + noise(random));
  }
  const PhaseDrift drift = phase_drift(t, x, 4.0);
  EXPECT_NEAR(drift.frequency_hz, 4.002, 1e-4);
  EXPECT_NEAR(drift.turns, 0.002 / 4.0 * 26.0, 1e-3);
  EXPECT_LT(std::fabs(phase_drift(t, x, 4.002).turns), 1e-3);
  EXPECT_EQ(phase_drift({0.0, 0.1, 0.2}, {0.0, 1.0, 0.0}, 4.0).turns, 0.0);
}

}  // namespace
}  // namespace shaker::estimator
