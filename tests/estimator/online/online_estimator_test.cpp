#include "estimator/online/online_estimator.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "estimator/fit/estimation.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

// Cycles of the SI oleo with white noise on a fine Fourier grid, which is another scheme than
// the estimator's.
class Rig {
 public:
  MeasuredCycle cycle(int run, long index) {
    const double f = run == 0 ? 2.0 : 1.0;
    if (solutions_.size() <= static_cast<std::size_t>(run)) {
      PeriodicSystem system(model_, {Scheme::fourier, 320, false});
      system.set_excitation(f, 3.048);
      EXPECT_EQ(system.solve_from_rest(testing::kOleoSi).status, SolveStatus::converged);
      std::vector<double> u;
      for (int i = 0; i < 64; ++i)
        u.push_back(system.value(5 * i, 0));
      solutions_.push_back(u);
    }
    MeasuredCycle c;
    c.run = run;
    c.index = index;
    c.frequency_hz = f;
    c.amplitude = 3.048;
    for (const double u : solutions_[static_cast<std::size_t>(run)])
      c.displacement.push_back(u + noise_(random_));
    return c;
  }

 private:
  Model model_{testing::oleo()};
  std::vector<std::vector<double>> solutions_;
  std::mt19937_64 random_{9};
  std::normal_distribution<double> noise_{0.0, 2e-5};
};

config::ModelSpec started_off() {
  auto spec = testing::oleo();
  spec.effects[0].parameters["theta1"].start = 20.0;
  spec.effects[1].parameters["theta2"].start = 1.3;
  spec.effects[1].parameters["theta3"].start = 5.0;
  spec.effects[1].parameters["theta4"].start = 1.1;
  return spec;
}

TEST(OnlineEstimator, NarrowsItsIntervalsCycleByCycleAndAcrossRuns) {
  Rig rig;
  OnlineEstimator online(started_off());
  double first = 0.0, last = 0.0;
  for (int run = 0; run < 2; ++run) {
    for (long index = 0; index < 8; ++index) {
      const auto estimate = online.add(rig.cycle(run, index));
      ASSERT_TRUE(estimate.ok()) << estimate.error().what;
      EXPECT_TRUE(estimate->usable);
      EXPECT_EQ(estimate->cycles, 8 * run + index + 1);
      EXPECT_EQ(estimate->runs, run + 1);
      for (std::size_t k = 0; k < 4; ++k) {
        const auto& p = estimate->parameters[k];
        EXPECT_LT(std::fabs(p.value - testing::kOleoSi[k]), 5.0 * p.standard_error) << p.name;
      }
      if (run == 0 && index == 0) first = estimate->parameters[0].standard_error;
      last = estimate->parameters[0].standard_error;
      EXPECT_NEAR(estimate->noise_standard_deviation, 2e-5, 6e-6);
    }
  }
  EXPECT_LT(last, 0.35 * first);
}

TEST(OnlineEstimator, EndsWhereTheBatchOfAllItsCyclesEnds) {
  Rig rig;
  OnlineEstimator online(started_off());
  std::vector<RunData> single;
  Estimate last;
  for (int run = 0; run < 2; ++run) {
    for (long index = 0; index < 4; ++index) {
      const MeasuredCycle cycle = rig.cycle(run, index);
      RunData data;
      data.frequency_hz = cycle.frequency_hz;
      data.amplitude = cycle.amplitude;
      data.displacement = cycle.displacement;
      single.push_back(data);
      last = *online.add(cycle);
    }
  }
  const Model model(started_off());
  EstimationOptions options;
  options.grid = {Scheme::order6, OnlineOptions{}.grid_points, true};
  Estimator batch(model, single, options);
  const Fit& fit = batch.fit(model.start());
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(last.parameters[k].value / fit.theta[k], 1.0, 1e-7);
    EXPECT_NEAR(last.parameters[k].standard_error / fit.standard_error[k], 1.0, 1e-5);
  }
  EXPECT_NEAR(last.sum_of_squares / fit.sum_of_squares, 1.0, 1e-8);
  EXPECT_EQ(last.observations, fit.observations);
}

Estimate after_ten_cycles_of_two_runs(const config::ModelSpec& model) {
  Rig rig;
  OnlineEstimator online(model);
  Estimate last;
  for (int run = 0; run < 2; ++run) {
    for (long index = 0; index < 10; ++index)
      last = online.add(rig.cycle(run, index)).value();
  }
  return last;
}

TEST(OnlineEstimator, SaysThatARightModelLeavesOnlyTheScatter) {
  const Estimate estimate = after_ten_cycles_of_two_runs(started_off());
  EXPECT_NEAR(estimate.gap.noise_floor, 2e-5 / std::sqrt(10.0), 0.6e-6);
  EXPECT_NEAR(estimate.gap.size, estimate.gap.noise_floor, 1.5e-6);
  EXPECT_TRUE(estimate.warnings.empty()) << estimate.warnings.front();
}

TEST(OnlineEstimator, WarnsThatAWrongModelLeavesMoreThanTheScatter) {
  auto wrong = started_off();  // a gas that the other parameters cannot imitate
  wrong.effects[1].parameters["theta4"].start = 1.2;
  wrong.effects[1].parameters["theta4"].fixed = true;
  const Estimate estimate = after_ten_cycles_of_two_runs(wrong);
  EXPECT_NEAR(estimate.gap.noise_floor, 2e-5 / std::sqrt(10.0), 0.6e-6);
  EXPECT_GT(estimate.gap.size, 3.0 * estimate.gap.noise_floor);
  ASSERT_EQ(estimate.warnings.size(), 1u);
  EXPECT_NE(estimate.warnings[0].find("the model misses the mean cycles by"), std::string::npos);
  EXPECT_NE(estimate.warnings[0].find("the most in run 2 (1 Hz)"), std::string::npos);
}

TEST(OnlineEstimator, SaysTheGapInTheModelsUnitOfLength) {
  auto wrong = started_off();
  wrong.effects[1].parameters["theta4"].start = 1.2;
  wrong.effects[1].parameters["theta4"].fixed = true;
  wrong.length_unit = "ft";
  const Estimate estimate = after_ten_cycles_of_two_runs(wrong);
  ASSERT_EQ(estimate.warnings.size(), 1u);
  EXPECT_EQ(estimate.warnings[0].find("mm"), std::string::npos) << estimate.warnings[0];
  EXPECT_NE(estimate.warnings[0].find(" ft, "), std::string::npos) << estimate.warnings[0];
}

TEST(OnlineEstimator, LeavesOutABadCycleAndGoesOn) {
  Rig rig;
  OnlineEstimator online(started_off());
  ASSERT_TRUE(online.add(rig.cycle(0, 0)).ok());
  MeasuredCycle bad = rig.cycle(0, 1);
  bad.displacement[5] = std::nan("");
  EXPECT_FALSE(online.add(bad).ok());
  bad = rig.cycle(0, 1);
  bad.displacement.resize(32);
  EXPECT_FALSE(online.add(bad).ok());
  const auto estimate = online.add(rig.cycle(0, 1));
  ASSERT_TRUE(estimate.ok());
  EXPECT_EQ(estimate->cycles, 2);
}

TEST(OnlineEstimator, ForgetsNothingForACycleThatItRefuses) {
  OnlineOptions options;
  options.forgetting = 0.8;
  Rig one, other;
  OnlineEstimator undisturbed(started_off(), options), disturbed(started_off(), options);
  Estimate expected, estimate;
  for (long index = 0; index < 4; ++index) {
    expected = undisturbed.add(one.cycle(0, index)).value();
    estimate = disturbed.add(other.cycle(0, index)).value();
    MeasuredCycle still;
    still.run = 1;
    still.frequency_hz = 1.0;
    still.displacement.assign(64, 0.0);
    EXPECT_FALSE(disturbed.add(still).ok());
  }
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_DOUBLE_EQ(estimate.parameters[k].standard_error, expected.parameters[k].standard_error);
}

TEST(OnlineEstimator, StartsAfreshAfterAReset) {
  Rig rig;
  OnlineEstimator online(started_off());
  ASSERT_TRUE(online.add(rig.cycle(0, 0)).ok());
  online.reset();
  const auto estimate = online.add(rig.cycle(1, 0));
  ASSERT_TRUE(estimate.ok());
  EXPECT_EQ(estimate->runs, 1);
}

}  // namespace
}  // namespace shaker::estimator
