#include "estimator/diagnosis/noise/internal/above_noise.hpp"

#include <cmath>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/records/internal/transient_run.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::HasSubstr;

RunDatum datum(const std::string& name, double error) {
  RunDatum made;
  made.name = name;
  made.response = made.error = Eigen::VectorXd::Zero(5);
  made.error[2] = error;
  return made;
}

TEST(AboveNoise, RefusesACampaignOfWhichNoRunMovesMoreThanItsErrors) {
  std::vector<std::string> warnings;
  const auto good = above_noise({datum("a", 1.5), datum("b", 20.0)}, {1.2, 0.7}, "mm", warnings);
  ASSERT_FALSE(good);
  EXPECT_THAT(good.error().what,
              HasSubstr("not even run a, with errors of 1.06 mm beside a motion of 0.56"));
}

TEST(AboveNoise, WarnsOfARunWhoseErrorsAreAThirdOfItsMotion) {
  std::vector<std::string> warnings;
  ASSERT_TRUE(above_noise({datum("a", 0.3), datum("b", 0.4), datum("c", 9.0)}, {0.7, 0.7, 0.7},
                          "mm", warnings));
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_THAT(warnings[0], HasSubstr("run b hardly stands out of its noise"));
  EXPECT_THAT(warnings[0], HasSubstr("44 % of what it does"));
  EXPECT_THAT(warnings[1], HasSubstr("100 % of what it does"));
}

TEST(AboveNoise, CountsNoMeanAsMotion) {
  Eigen::VectorXd harmonics(3);
  harmonics << 100.0, 3.0, 4.0;
  EXPECT_DOUBLE_EQ(motion_of(harmonics), 5.0 / std::sqrt(2.0));
}

// A voltage of 0.1 V may drive an acceleration of 3 m/s^2.
TEST(AboveNoise, CountsTheForceOfTheInertiaBesideAnExcitationInAnotherUnit) {
  RunDatum run = datum("a", 0.1);
  run.response[1] = 0.1;
  const double excitation = motion_of(run.response);
  auto sampled = std::make_shared<SampledRun>();
  sampled->a = Eigen::Vector4d(4.0, -2.0, 4.0, -2.0);  // 1 +- 3
  run.sampled = sampled;
  run.kind = Kind::transient;
  EXPECT_DOUBLE_EQ(motion_in(run), excitation);  // a displacement is compared
  run.by_force = true;
  EXPECT_DOUBLE_EQ(motion_in(run), 3.0);
  run.kind = Kind::imposed_motion;  // its force was measured
  EXPECT_DOUBLE_EQ(motion_in(run), excitation);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
