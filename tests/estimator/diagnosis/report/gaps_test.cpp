// What runs that were not fitted say of a fit.
#include "estimator/diagnosis/report/internal/gaps.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kError = 0.01, kFrequencies[] = {0.5, 1.0, 2.0, 3.0};
constexpr int kHarmonics = 3, kCampaigns = 250;

config::ModelSpec spring_and_dashpot() {
  return estimator::testing::model_of({estimator::testing::effect("viscous_damping"),
                                       estimator::testing::effect("linear_stiffness")});
}

// Forces of 3 v + k u along u = 0.02 cos(phase), with white noise. `stiffness`: of each run.
std::vector<RunDatum> measured(const std::vector<double>& stiffness, Role last, unsigned seed) {
  std::mt19937_64 source(seed);
  std::normal_distribution<double> normal;
  std::vector<RunDatum> data;
  for (std::size_t r = 0; r < stiffness.size(); ++r) {
    RunDatum datum;
    datum.name = "r" + std::to_string(r);
    datum.kind = Kind::imposed_motion;
    datum.role = r + 1 == stiffness.size() ? last : Role::fit;
    datum.frequency_hz = kFrequencies[r];
    datum.driver = Eigen::VectorXd::Zero(3);
    datum.driver[1] = 0.02;
    datum.response = Eigen::VectorXd::Zero(2 * kHarmonics + 1);
    datum.response[1] = stiffness[r] * 0.02;
    datum.response[2] = -3.0 * 0.02 * 2.0 * std::numbers::pi * kFrequencies[r];
    for (double& x : datum.response)
      x += kError * normal(source);
    datum.error = Eigen::VectorXd::Constant(datum.response.size(), kError);
    datum.freedom = Eigen::VectorXd::Constant(datum.response.size(), 1e6);
    data.push_back(std::move(datum));
  }
  return data;
}

// The gap of what was not fitted, over the level that it has by chance.
double over_level(const std::vector<RunDatum>& data) {
  const HarmonicFit fit = fit_harmonics(spring_and_dashpot(), data, {2.0, 30.0}, nullptr, {});
  EXPECT_TRUE(fit.trouble.empty()) << fit.trouble;
  Diagnosis said;
  const std::vector<SteadyRun> runs(data.size());
  const double level = tell_gaps({fit, data}, {fit, data}, data, data, runs, said);
  EXPECT_GT(level, 0.0);
  return *said.gap.held_out_after / level;
}

TEST(Gaps, OfRunsThatWereNotFittedAreSeldomAboveTheirLevelByChance) {
  for (const Role last : {Role::fit, Role::held_out}) {
    int above = 0;
    double highest = 0.0;
    for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
      const double over = over_level(measured({40.0, 40.0, 40.0, 40.0}, last, seed));
      above += over > 1.0 ? 1 : 0;
      highest = std::max(highest, over);
    }
    // Five in a hundred: a sum of few squares is so far above its mean more often than a normal
    // number, which is one time in 44.
    EXPECT_GT(above, 0);
    EXPECT_LT(above, kCampaigns / 10) << highest;
  }
}

TEST(Gaps, OfARunThatTheOthersPredictWronglyAreAboveTheirLevel) {
  for (const Role last : {Role::fit, Role::held_out}) {
    for (unsigned seed = 1; seed <= 10; ++seed)
      EXPECT_GT(over_level(measured({40.0, 40.0, 40.0, 46.0}, last, seed)), 1.0) << seed;
  }
}

// A cubic spring in two runs on a dynamometer, and a linear one in the third, which is held out:
// `cubic` of its own.
Campaign with_held_out(double cubic) {
  std::mt19937_64 source(5);
  std::normal_distribution<double> normal;
  Campaign campaign;
  for (const double amplitude : {0.01, 0.02, 0.03}) {
    Recording run;
    run.name = "r" + std::to_string(campaign.runs.size());
    run.kind = Kind::imposed_motion;
    run.frequency_hz = 100.0 * amplitude;
    run.role_given = true;
    const bool last = campaign.runs.size() == 2;
    run.role = last ? Role::held_out : Role::fit;
    for (int i = 0; i < 12 * 200; ++i) {
      const double phase = 2.0 * std::numbers::pi * i / 200.0;
      const double u = amplitude * std::cos(phase);
      const double v = -2.0 * std::numbers::pi * run.frequency_hz * amplitude * std::sin(phase);
      run.t.push_back(i / (200.0 * run.frequency_hz));
      run.displacement.push_back(u);
      run.force.push_back(3.0 * v + 40.0 * u + (last ? cubic : 3e4) * u * u * u +
                          0.01 * normal(source));
    }
    campaign.runs.push_back(std::move(run));
  }
  return campaign;
}

TEST(Gaps, ThatGrowOnARunThatWasNotFittedAreNotCalledExplained) {
  const auto right = diagnose(with_held_out(3e4), spring_and_dashpot());
  ASSERT_TRUE(right) << right.error().what;
  EXPECT_EQ(right->verdict, Verdict::explained);
  const auto wrong = diagnose(with_held_out(0.0), spring_and_dashpot());
  ASSERT_TRUE(wrong) << wrong.error().what;
  EXPECT_EQ(wrong->verdict, Verdict::unexplained);
  ASSERT_FALSE(wrong->effects.empty());
  EXPECT_EQ(wrong->effects[0].name, right->effects.at(0).name);
  EXPECT_GT(*wrong->gap.held_out_after, *wrong->gap.held_out_before);
  // As probable as beside an unknown of which it closes nothing: odds of 0.2.
  EXPECT_LE(wrong->effects[0].probability, 0.2 / 1.2);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
