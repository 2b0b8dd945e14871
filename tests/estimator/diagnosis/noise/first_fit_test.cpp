#include "estimator/diagnosis/noise/internal/first_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/internal/cut_campaign.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

std::vector<RunDatum> weighed(const Campaign& campaign) {
  std::vector<std::string> warnings;
  const auto runs = cut_campaign(campaign, {}, warnings);
  EXPECT_TRUE(runs) << runs.error().what;
  return runs ? weigh(*runs).data : std::vector<RunDatum>{};
}

FitOptions from_rest() {
  FitOptions options;
  options.from_rest = true;
  return options;
}

config::ModelSpec oscillator(double c, double k) {
  auto spec = estimator::testing::linear_oscillator();
  spec.effects[0].parameters["c"].start = c;
  spec.effects[1].parameters["k"].start = k;
  return spec;
}

TEST(FirstFit, ForcesAlongTheMotionTellTheParametersNearlyFromAnywhere) {
  const auto data = weighed(testing::recorded({{"theta1", 1.6}, {"theta2", 80.0}},
                                              {{2.0, 1.0}, {3.0, 2.0}, {4.0, 2.0}}, 5, "linear"));
  const config::ModelSpec far = oscillator(16.0, 800.0);
  std::vector<RunDatum> forces;
  for (const RunDatum& datum : data)
    forces.push_back(forces_along_motion(datum, Model(far)));
  const HarmonicFit fit = fit_harmonics(far, forces, {}, nullptr, from_rest());
  ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
  EXPECT_NEAR(fit.theta[0], 1.6, 0.02 * 1.6);
  EXPECT_NEAR(fit.theta[1], 80.0, 0.02 * 80.0);
  EXPECT_EQ(fitted_to_forces(far, data, {}, from_rest()), fit.theta);
}

TEST(FirstFit, OfAnOleoTooAndIsThatOfTheResponseInTheEnd) {
  const auto data = weighed(testing::recorded({}, testing::kSixRuns, 5));
  auto far = estimator::testing::oleo();
  far.effects[0].parameters["theta1"].start = 300.0;
  const HarmonicFit near = fit_harmonics(far, data, estimator::testing::kOleoSi, nullptr, {});
  const HarmonicFit fit = first_fit(far, data, from_rest());
  ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
  EXPECT_NEAR(fit.chi_squared, near.chi_squared, 0.1);
  EXPECT_NEAR(fit.theta[0], estimator::testing::kOleoSi[0], 0.01 * estimator::testing::kOleoSi[0]);
}

// The fit of the response alone, started above the resonance, does not converge or ends in a
// wrong minimum.
TEST(FirstFit, FindsTheDamperWhereTheResponseAloneIsLost) {
  int lost = 0;
  for (const double damping : {1.6, 6.0}) {
    const auto data = weighed(testing::recorded({{"theta1", damping}, {"theta2", 80.0}},
                                                {{2.0, 1.0}, {3.0, 2.0}, {4.0, 2.0}}, 5, "linear"));
    const config::ModelSpec far = oscillator(10.0 * damping, 800.0);
    const HarmonicFit alone = fit_harmonics(far, data, {}, nullptr, from_rest());
    const HarmonicFit fit = first_fit(far, data, from_rest());
    if (!alone.trouble.empty() || alone.chi_squared > 100.0 * fit.chi_squared) ++lost;
    ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
    EXPECT_NEAR(fit.theta[0], damping, 0.02 * damping);
    EXPECT_NEAR(fit.theta[1], 80.0, 0.5);
  }
  EXPECT_GT(lost, 0);
}

// For a model of two masses the forces along the motion of one of them are not defined.
TEST(FirstFit, LeavesSeveralMassesToTheResponse) {
  const auto data = weighed(testing::recorded({}, testing::kSixRuns, 5));
  const auto two = estimator::testing::oleo_on_tyre(0.1);
  const HarmonicFit alone = fit_harmonics(two, data, {}, nullptr, from_rest());
  const HarmonicFit fit = first_fit(two, data, from_rest());
  EXPECT_TRUE(fitted_to_forces(two, data, {}, from_rest()).empty());
  EXPECT_EQ(fit.theta, alone.theta);
  EXPECT_EQ(fit.trouble, alone.trouble);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
