// The estimate must be on the branch on which the rig was measured. The data come from Odeint.
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/fit/estimation.hpp"
#include "estimator/solve/periodic/continuation.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/estimator/solve/periodic/duffing_in_time.hpp"

namespace shaker::estimator {
namespace {

using ::testing::Contains;
using testing::DuffingInTime;
using ::testing::HasSubstr;
using testing::State;

const std::vector<double> kBranchTruth = {0.05, 1.0, 0.1};  // c, k, k3
constexpr double kBranchOmega = 1.2, kAmplitude = 0.18;     // two stable solutions, one between

RunData run_of(const DuffingInTime& plant, State start, int settle, int periods = 1) {
  RunData run;
  run.frequency_hz = plant.omega / (2.0 * std::numbers::pi);
  run.amplitude = plant.amplitude;
  run.periods = periods;
  run.displacement = plant.record(plant.after_periods(start, settle), periods, 48 * periods);
  return run;
}

std::vector<double> off(double c, double k, double k3) {
  return {c * kBranchTruth[0], k * kBranchTruth[1], k3 * kBranchTruth[2]};
}

class Bistable : public ::testing::TestWithParam<std::tuple<bool, Method>> {};

TEST_P(Bistable, DataOfEitherBranchGiveTheTruthFromEveryStart) {
  const auto [upper, method] = GetParam();
  const DuffingInTime plant{kBranchTruth, 0.0, kBranchOmega, kAmplitude};
  const RunData run = run_of(plant, upper ? State{2.5, 0.0} : State{0.0, 0.0}, 250);
  const double most = *std::max_element(run.displacement.begin(), run.displacement.end());
  ASSERT_EQ(most > 2.0, upper) << "the integration settled on the other branch";
  const Model model(testing::duffing());
  EstimationOptions options;
  options.method = method;
  Estimator estimator(model, {run}, options);
  // The last two starts have no upper branch at this frequency.
  for (const auto& start :
       {off(1, 1, 1), off(1.05, 0.98, 1.05), off(2.0, 1.0, 0.6), off(1.5, 0.9, 0.5)}) {
    const Fit& fit = estimator.fit(start);
    EXPECT_EQ(fit.status, FitStatus::converged) << fit.trouble;
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(fit.theta[k], kBranchTruth[k], 2e-5 * kBranchTruth[k])
          << k << " from " << start[2];
    for (const std::string& warning : estimator.describe().warnings)
      EXPECT_THAT(warning, Not(HasSubstr("branch"))) << warning;
  }
}

INSTANTIATE_TEST_SUITE_P(Fits, Bistable,
                         ::testing::Combine(::testing::Bool(),
                                            ::testing::Values(Method::lifted,
                                                              Method::levenberg_marquardt)));

TEST(BranchWarnings, SayThatTheFittedSolutionIsUnstable) {
  const Model model(testing::duffing());
  Continuation continuation(model, kBranchTruth);
  const Branch branch = continuation.over_frequency(kAmplitude, 0.9 / (2.0 * std::numbers::pi),
                                                    1.5 / (2.0 * std::numbers::pi));
  const auto found = continuation.solutions_at(branch, kBranchOmega / (2.0 * std::numbers::pi));
  ASSERT_EQ(found.size(), 3u);
  RunData run;
  run.frequency_hz = kBranchOmega / (2.0 * std::numbers::pi);
  run.amplitude = kAmplitude;
  for (std::size_t i = 0; i < found[1].at.z.size(); i += 8)
    run.displacement.push_back(found[1].at.z[i]);
  Estimator estimator(model, {run});
  estimator.fit(kBranchTruth);
  const Estimate estimate = estimator.describe();
  EXPECT_THAT(estimate.warnings, Contains(HasSubstr("unstable")));
  EXPECT_FALSE(estimate.usable);
}

TEST(BranchWarnings, SayThatAnotherBranchIsNearerToTheData) {
  // All parameters are fixed: the fit cannot change, and Gauss-Newton from a solution on the
  // lower branch stays there.
  config::ModelSpec spec = testing::duffing();
  const char* names[] = {"c", "k", "k3"};
  for (int k = 0; k < 3; ++k) {
    config::ParameterSpec parameter;
    parameter.start = kBranchTruth[k];
    parameter.fixed = true;
    spec.effects[k].parameters[names[k]] = parameter;
  }
  const Model model(spec);
  const DuffingInTime plant{kBranchTruth, 0.0, kBranchOmega, kAmplitude};
  Estimator estimator(model, {run_of(plant, {0.0, 0.0}, 250)});
  estimator.fit(kBranchTruth);
  EXPECT_THAT(estimator.describe().warnings, Not(Contains(HasSubstr("branch"))));
  estimator.update_run(0, run_of(plant, {2.5, 0.0}, 250));
  estimator.fit(kBranchTruth, true);  // warm start on the lower branch
  const Estimate estimate = estimator.describe();
  EXPECT_THAT(estimate.warnings, Contains(HasSubstr("another branch")));
  EXPECT_FALSE(estimate.usable);
}

TEST(NoSolution, IsTheFitsTroubleWithHowFarTheExcitationGot) {
  config::ModelSpec spec = testing::duffing();
  spec.effects.push_back(testing::effect("gravity"));
  spec.gravity = 0.3;
  const double values[] = {0.2, 1.0, -1.0};
  const char* names[] = {"c", "k", "k3"};
  for (int k = 0; k < 3; ++k) {
    config::ParameterSpec parameter;
    parameter.start = values[k];
    parameter.fixed = k > 0;
    // With much more damping the spring would hold the load, with none the motion would be large:
    // there would be a solution.
    if (k == 0) {
      parameter.lower = 0.1;
      parameter.upper = 0.3;
    }
    spec.effects[k].parameters[names[k]] = parameter;
  }
  const Model model(spec);
  RunData run;
  run.frequency_hz = 0.2 / (2.0 * std::numbers::pi);
  run.amplitude = 0.5;
  // Newton's method starts at the data, near the existing solutions, so its result does not
  // depend on chance.
  for (int i = 0; i < 40; ++i)
    run.displacement.push_back(0.3 + 0.1 * std::cos(2.0 * std::numbers::pi * i / 40));
  Estimator estimator(model, {run});
  const Fit& fit = estimator.fit(model.start());
  EXPECT_EQ(fit.status, FitStatus::no_solution);
  EXPECT_THAT(fit.trouble, HasSubstr("the continuation in amplitude got to"));
  EXPECT_THAT(fit.trouble, HasSubstr("turn back"));
}

TEST(TwoPeriods, AreEstimatedFromARecordOfBoth) {
  config::ModelSpec spec = testing::duffing();
  spec.effects.push_back(testing::effect("gravity"));
  spec.gravity = 0.8;
  const Model model(spec);
  const std::vector<double> truth = {0.08, 1.0, 1.0};
  const double omega = 3.1;
  RunData run;
  double amplitude = 0.4;
  for (; amplitude < 3.0; amplitude += 0.2) {
    const DuffingInTime plant{truth, 0.8, omega, amplitude};
    const State settled = plant.after_periods({0.6, 0.1}, 300);
    const State one = plant.after_periods(settled, 1), two = plant.after_periods(settled, 2);
    if (std::fabs(one[0] - settled[0]) > 0.05 && std::fabs(two[0] - settled[0]) < 1e-6) {
      run = run_of(plant, settled, 0, 2);
      break;
    }
  }
  ASSERT_FALSE(run.displacement.empty()) << "the integration found no response of two periods";
  Estimator estimator(model, {run});
  const Fit& fit = estimator.fit({0.09, 0.97, 1.04});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(fit.theta[k], truth[k], 1e-4 * truth[k]);
  for (const std::string& warning : estimator.describe().warnings)
    EXPECT_THAT(warning, Not(HasSubstr("period"))) << warning;
}

}  // namespace
}  // namespace shaker::estimator
