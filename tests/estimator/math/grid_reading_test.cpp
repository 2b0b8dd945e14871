#include "estimator/math/grid_reading.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

template <class Function>
double read(const GridReading& reading, int points, Function value) {
  double sum = 0.0;
  for (int k = 0; k < reading.count; ++k)
    sum += reading.weight[k] * value((reading.base + k) % points);
  return sum;
}

TEST(GridReading, IsExactForAPolynomialOfDegreeFive) {
  const auto value = [](double x) { return 3.0 - x + 0.5 * x * x - 0.01 * std::pow(x, 5); };
  for (const double at : {10.0, 10.25, 11.5, 12.999}) {
    const GridReading reading = grid_reading_at(at / 32.0, 32);
    EXPECT_EQ(reading.count, 6);
    EXPECT_NEAR(read(reading, 32, value), value(at), 1e-9 * std::fabs(value(at))) << at;
  }
}

TEST(GridReading, GoesRoundThePeriodAtBothEnds) {
  const auto value = [](int i) { return std::cos(2.0 * std::numbers::pi * i / 64.0); };
  for (const double tau : {0.001, 0.02, 0.99, 1.001, -0.3, 7.25}) {
    const GridReading reading = grid_reading_at(tau, 64);
    EXPECT_GE(reading.base, 0);
    EXPECT_LT(reading.base, 64);
    EXPECT_NEAR(read(reading, 64, value), std::cos(2.0 * std::numbers::pi * tau), 1e-7) << tau;
  }
}

}  // namespace
}  // namespace shaker::estimator
