#include "estimator/math/simd_math.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

double ulps(double got, double want) {
  return std::fabs(got - want) / (std::nextafter(std::fabs(want), INFINITY) - std::fabs(want));
}

TEST(FastLog, IsWithinTwoUlpOfLibmAwayFromOneAndAbsolutelyCloseNearIt) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-300.0, 300.0);
  for (int i = 0; i < 200000; ++i) {
    const double x = std::pow(10.0, exponent(random));
    EXPECT_LE(ulps(fast_log(x), std::log(x)), 2.0) << x;
  }
  std::uniform_real_distribution<double> near(0.3, 3.0);
  for (int i = 0; i < 200000; ++i) {
    const double x = near(random);
    EXPECT_NEAR(fast_log(x), std::log(x), 3e-16 + 3e-16 * std::fabs(std::log(x))) << x;
  }
  EXPECT_EQ(fast_log(1.0), 0.0);
}

TEST(FastExp, IsWithinTwoUlpOfLibm) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> wide(-600.0, 600.0), narrow(-3.0, 3.0);
  for (int i = 0; i < 200000; ++i) {
    const double x = i % 2 == 0 ? wide(random) : narrow(random);
    EXPECT_LE(ulps(fast_exp(x), std::exp(x)), 2.0) << x;
  }
  EXPECT_EQ(fast_exp(0.0), 1.0);
}

}  // namespace
}  // namespace shaker::estimator
