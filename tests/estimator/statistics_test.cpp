#include "estimator/statistics.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

// Table of Student's t, 97.5 %: 12.706 for one degree of freedom, 2.028 for 36, 1.960 in the limit.
TEST(StudentT, GivesThePrintedQuantiles) {
  EXPECT_NEAR(student_t_quantile(0.975, 1), 12.706, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 36), 2.028, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 1e7), 1.95996, 1e-5);
}

}  // namespace
}  // namespace shaker::estimator
