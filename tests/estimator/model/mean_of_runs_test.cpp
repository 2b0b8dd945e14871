#include "estimator/model/mean_of_runs.hpp"

#include <gmock/gmock.h>

namespace shaker::estimator {
namespace {

using ::testing::ElementsAre;

// Two parameters, of which one has a value in each of three runs.
TEST(MeanOfRuns, IsWhatOneMoreRunHas) {
  const std::vector<ModelNumber> places = {
      {0, "c", false}, {1, "k", false}, {1, "k", false}, {1, "k", false}};
  const MeanOfRuns mean = mean_of_runs(places, {2.0, 10.0, 12.0, 17.0});
  ASSERT_EQ(mean.numbers.size(), 2U);
  EXPECT_EQ(mean.numbers[1].symbol, "k");
  EXPECT_THAT(mean.values, ElementsAre(2.0, 13.0));
  EXPECT_EQ(mean.scatter[0], 0.0);
  EXPECT_DOUBLE_EQ(mean.scatter[1], 13.0);  // (9 + 1 + 16) / 2
  Eigen::MatrixXd of_values = 0.3 * Eigen::MatrixXd::Identity(4, 4);
  of_values(0, 1) = of_values(1, 0) = 0.06;
  const Eigen::MatrixXd v = mean.covariance(of_values);
  EXPECT_DOUBLE_EQ(v(0, 0), 0.3);
  EXPECT_DOUBLE_EQ(v(0, 1), 0.02);
  EXPECT_DOUBLE_EQ(v(1, 1), 0.1 + 13.0);
}

// A constant is another number than a parameter of its name.
TEST(MeanOfRuns, KeepsParametersAndConstantsApart) {
  const MeanOfRuns mean = mean_of_runs({{0, "u0", false}, {0, "u0", true}}, {1.0, 3.0});
  EXPECT_THAT(mean.values, ElementsAre(1.0, 3.0));
  EXPECT_TRUE(mean.scatter.isZero());
}

}  // namespace
}  // namespace shaker::estimator
