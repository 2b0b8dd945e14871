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

}  // namespace
}  // namespace shaker::estimator
