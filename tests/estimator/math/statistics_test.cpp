#include "estimator/math/statistics.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

// Table of Student's t, 97.5 %: 12.706 for one degree of freedom, 2.028 for 36, 1.960 in the
// limit.
TEST(StudentT, GivesThePrintedQuantiles) {
  EXPECT_NEAR(student_t_quantile(0.975, 1), 12.706, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 36), 2.028, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 1e7), 1.95996, 1e-5);
}

// Boost's gamma function overflows for an exact fit of thousands of points.
TEST(ChiSquared, OfAnExactFitOfManyPointsIsOne) {
  EXPECT_EQ(chi_squared_above(1e-18, 3836), 1.0);
  EXPECT_EQ(chi_squared_above(0.0, 1e6), 1.0);
  EXPECT_NEAR(chi_squared_above(3836, 3836), 0.497, 2e-3);
  EXPECT_NEAR(chi_squared_above(11.0705, 5), 0.05, 1e-6);
}

// -2 zeta(3) at 1, -14 zeta(3) at 1/2, and less by 2 / x^3 from one x to the next below.
TEST(Statistics, TheDerivativeOfTrigammaIsThatOfItsSeries) {
  constexpr double kZeta3 = 1.2020569031595942;
  EXPECT_NEAR(tetragamma(1.0), -2.0 * kZeta3, 1e-13);
  EXPECT_NEAR(tetragamma(0.5), -14.0 * kZeta3, 1e-12);
  for (const double x : {0.01, 3.0, 12.0, 40.0}) {
    EXPECT_NEAR(tetragamma(x + 1.0) / (tetragamma(x) + 2.0 / (x * x * x)), 1.0, 1e-8) << x;
    const double h = 1e-4 * x;
    EXPECT_NEAR((trigamma(x + h) - trigamma(x - h)) / (2.0 * h) / tetragamma(x), 1.0, 1e-6) << x;
  }
}

}  // namespace
}  // namespace shaker::estimator
