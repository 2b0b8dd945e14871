#include "estimator/diagnosis/report/internal/curves.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;

// The measured motion is 0.1 + 0.02 cos + 0.01 sin at 2 Hz; the predicted one is 1.5 times
// that.
TEST(Curves, HoldTheVelocitiesOfThePredictedMotions) {
  RunDatum datum;
  datum.frequency_hz = 2.0;
  datum.response = VectorXd{{0.1, 0.02, 0.01}};
  const VectorXd before = 1.5 * datum.response;
  const MissingForce none{VectorXd::Constant(256, 0.1), VectorXd::Zero(256), VectorXd::Zero(256),
                          true};
  const RunCurves curves = curves_of(datum, before, datum.response, none, none);
  const double omega = 2.0 * std::numbers::pi * 2.0;
  ASSERT_EQ(curves.velocity_before.size(), curves.before.size());
  for (std::size_t i = 0; i < curves.before.size(); ++i) {
    const double phase =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(curves.before.size());
    const double velocity = omega * (-0.02 * std::sin(phase) + 0.01 * std::cos(phase));
    EXPECT_NEAR(curves.velocity_after[i], velocity, 1e-12);
    EXPECT_NEAR(curves.velocity_before[i], 1.5 * velocity, 1e-12);
  }
  EXPECT_EQ(curves.stroke, std::vector<double>(curves.before.size(), 0.1));
  datum.kind = Kind::imposed_motion;
  EXPECT_TRUE(curves_of(datum, before, before, none, none).velocity_before.empty());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
