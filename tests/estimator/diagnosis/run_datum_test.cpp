#include "estimator/diagnosis/internal/run_datum.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

RunDatum datum() {
  RunDatum d;
  d.name = "r01";
  d.response = Eigen::Vector3d(1.0, 2.0, 3.0);
  d.error = Eigen::Vector3d(0.5, 2.0, 4.0);
  return d;
}

TEST(RunDatum, IndependentErrorsAreDividedBy) {
  const RunDatum d = datum();
  const Eigen::VectorXd left = Eigen::Vector3d(1.0, -2.0, 8.0);
  EXPECT_TRUE(whitened(d, left).isApprox(Eigen::Vector3d(2.0, -1.0, 2.0)));
  EXPECT_TRUE(over_covariance(d, left).isApprox(Eigen::Vector3d(4.0, -0.5, 0.5)));
  EXPECT_TRUE(coloured(d, whitened(d, left)).isApprox(left));
  EXPECT_NEAR(log_scale(d), std::log(4.0), 1e-14);
}

TEST(RunDatum, ErrorsWithACovarianceGoThroughItsInverse) {
  RunDatum d = datum();
  Eigen::Matrix3d c;
  c << 4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0;
  set_covariance(d, c);
  const Eigen::VectorXd left = Eigen::Vector3d(1.0, -2.0, 8.0);
  EXPECT_TRUE(covariance_of(d).isApprox(c, 1e-10));
  EXPECT_TRUE(over_covariance(d, left).isApprox(c.inverse() * left, 1e-10));
  EXPECT_NEAR(whitened(d, left).squaredNorm(), left.dot(c.inverse() * left), 1e-10);
  EXPECT_NEAR(log_scale(d), 0.5 * std::log(c.determinant()), 1e-10);
  EXPECT_TRUE(d.error.isApprox(c.diagonal().cwiseSqrt(), 1e-12));
}

TEST(RunDatum, RefusesWhatIsNoCovariance) {
  RunDatum d = datum();
  Eigen::Matrix3d c = Eigen::Matrix3d::Identity();
  c(0, 1) = c(1, 0) = 2.0;
  EXPECT_THROW(set_covariance(d, c), std::invalid_argument);
}

TEST(RunDatum, ChannelsOfARunAreOfOneResponse) {
  RunDatum displacement = datum();
  displacement.driver = Eigen::Vector3d(0.0, 1.0, 0.0);
  RunDatum load = displacement;
  load.quantity = Quantity::damper_force;
  load.motion = displacement.response;
  load.response = Eigen::Vector3d(9.0, 8.0, 7.0);
  RunDatum repeated = displacement;  // the same drive, another response
  repeated.response[1] += 0.1;
  RunDatum held_out = load;
  held_out.role = Role::held_out;
  const std::vector<RunDatum> data = {displacement, repeated, load, held_out};
  EXPECT_EQ(first_of_response(data, 0), 0U);
  EXPECT_EQ(first_of_response(data, 1), 1U);
  EXPECT_EQ(first_of_response(data, 2), 0U);
  EXPECT_EQ(first_of_response(data, 3), 3U);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
