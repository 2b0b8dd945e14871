// Cycles that repeat after one period or several, for tests of repetition.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "estimator/signal/cycles.hpp"

namespace shaker::estimator::testing {

inline constexpr double kTurn = 2.0 * std::numbers::pi;
inline constexpr std::size_t kPoints = 32;  // of a cycle

// A motion of amplitude 1 with a subharmonic of `share` over `periods`, and white noise.
inline Cycles motion(int count, int periods, double share, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  Cycles cycles{{}, kPoints};
  for (std::size_t i = 0; i < kPoints * static_cast<std::size_t>(count); ++i) {
    const double tau = static_cast<double>(i) / static_cast<double>(kPoints);
    cycles.y.push_back(std::cos(kTurn * tau) + share * std::cos(kTurn * tau / periods) +
                       noise * normal(random));
  }
  return cycles;
}

}  // namespace shaker::estimator::testing
