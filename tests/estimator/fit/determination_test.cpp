#include "estimator/fit/determination.hpp"

#include <random>

#include <gmock/gmock.h>

#include "estimator/inference/monte_carlo.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Fit fit_of(const Model& model, const std::vector<RunDesign>& design,
           const std::vector<double>& truth, double noise) {
  auto runs = *exact_data(model, design, truth);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, noise);
  for (RunData& run : runs)
    for (double& u : run.displacement)
      u += normal(random);
  Estimator estimator(model, runs);
  return estimator.fit(truth);
}

// (6.1) of the paper: of two dampers only the sum has an effect, so one replaces the other 1 to
// 1.
TEST(Determination, NamesTheCombinationThatTheDataDoNotFeel) {
  const Model model(
      testing::model_of({testing::effect("viscous_damping"), testing::effect("viscous_damping"),
                         testing::effect("linear_stiffness")}));
  const Fit fit = fit_of(model, {{1.0, 2.0, 40, 1.0}}, {1.0, 2.0, 60.0}, 1e-4);
  ASSERT_EQ(fit.status, FitStatus::undetermined);
  const auto open = open_directions(model, fit);
  ASSERT_EQ(open.size(), 1U);
  EXPECT_TRUE(open[0].lost);
  // The same amount in their unit, with opposite signs.
  EXPECT_NEAR(open[0].change[0] * fit.theta[0], -open[0].change[1] * fit.theta[1], 1e-6);
  EXPECT_NEAR(open[0].change[2], 0.0, 1e-6);
  const auto warnings = determination_warnings(model, fit);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], AllOf(HasSubstr("c by "), HasSubstr(" with "), HasSubstr("fix one")));
}

TEST(Determination, SaysThatFigure13HardlyDeterminesTheSpring) {
  const Model model(testing::oleo(32.178));
  const Fit weak = fit_of(model, {{2.0, 5.0, 40, 1.0}}, testing::kOleoFeet, 0.0032);
  const auto warnings = determination_warnings(model, weak);
  ASSERT_FALSE(warnings.empty());
  EXPECT_THAT(warnings[0], AllOf(HasSubstr("theta4"), HasSubstr("hardly determine")));
  const Fit good = fit_of(model, {{2.0, 10.0, 40, 1.0}}, testing::kOleoFeet, 0.0032);
  EXPECT_TRUE(determination_warnings(model, good).empty());
}

// Two independent oscillators. Only the first one is observed, so the parameters of the second one
// have no effect.
TEST(Determination, NamesAParameterThatDoesNothing) {
  auto spec = testing::linear_oscillator();
  spec.coordinates = {"a", "b"};
  spec.mass = {1.0, 0.0, 0.0, 1.0};
  spec.excitation = {1.0, 1.0};
  spec.observed = "a";
  for (auto& e : spec.effects)
    e.sees = e.acts = {1.0, 0.0};
  for (const char* name : {"viscous_damping", "linear_stiffness"}) {
    auto other = testing::effect(name);
    other.sees = other.acts = {0.0, 1.0};
    spec.effects.push_back(other);
  }
  const Model model(spec);
  const Fit fit = fit_of(model, {{1.0, 2.0, 40, 1.0}}, {3.0, 60.0, 2.0, 70.0}, 1e-4);
  ASSERT_EQ(fit.status, FitStatus::undetermined) << fit.trouble;
  EXPECT_TRUE(fit.determined[0]);
  EXPECT_FALSE(fit.determined[2]);
  EXPECT_FALSE(fit.determined[3]);
}

}  // namespace
}  // namespace shaker::estimator
