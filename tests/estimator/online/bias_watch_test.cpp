#include "estimator/online/internal/bias_watch.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "estimator/inference/monte_carlo.hpp"
#include "estimator/inference/second_order.hpp"
#include "estimator/online/online_estimator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::online {
namespace {

// Cycles of figure 12 with its noise, and the mean of those so far.
class Figure12 {
 public:
  Figure12() : mean((*exact_data(model, {{2.0, 10.0, 40, 1.0}}, testing::kOleoFeet))[0]) {
    exact_ = mean.displacement;
    mean.cycles = 0.0;
  }
  MeasuredCycle next() {
    MeasuredCycle cycle;
    cycle.index = static_cast<long>(mean.cycles);
    cycle.frequency_hz = 2.0;
    cycle.amplitude = 10.0;
    mean.cycles += 1.0;
    for (std::size_t j = 0; j < exact_.size(); ++j) {
      double& at = mean.displacement[j];
      const double y = exact_[j] + noise_(random_), off = y - at;
      cycle.displacement.push_back(y);
      at += off / mean.cycles;
      mean.scatter += off * (y - at);
    }
    return cycle;
  }
  // The estimate of a batch fit to the cycles so far.
  Estimate batch() {
    EstimationOptions options;
    options.grid.points = OnlineOptions{}.grid_points;
    Estimator estimator(model, {mean}, options);
    estimator.fit(testing::kOleoFeet);
    return published(estimator, model);
  }

  Model model{testing::oleo(32.178)};
  RunData mean;

 private:
  std::vector<double> exact_;
  std::mt19937_64 random_{3};
  std::normal_distribution<double> noise_{0.0, 0.01 * 0.5698 / std::sqrt(3.0)};
};

TEST(BiasWatch, EveryCyclesEstimateIsThatOfTheBatch) {
  Figure12 rig;
  auto spec = testing::oleo(32.178);
  spec.effects[0].parameters["theta1"].start = 5.3;
  spec.effects[1].parameters["theta2"].start = 5.2;
  spec.effects[1].parameters["theta3"].start = 1.7;
  spec.effects[1].parameters["theta4"].start = 1.05;
  OnlineEstimator online(spec);
  int with = 0, without = 0;
  for (int i = 0; i < 24; ++i) {
    const auto estimate = online.add(rig.next());
    ASSERT_TRUE(estimate.ok()) << estimate.error().what;
    const Estimate batch = rig.batch();
    ASSERT_EQ(estimate->parameters[3].bias != 0.0, batch.parameters[3].bias != 0.0) << i;
    ++(batch.parameters[3].bias != 0.0 ? with : without);
    for (std::size_t k = 0; k < 4; ++k) {
      const ParameterEstimate& p = batch.parameters[k];
      EXPECT_NEAR(estimate->parameters[k].value, p.value, 1e-4 * p.standard_error) << i;
      EXPECT_NEAR(estimate->parameters[k].bias, p.bias, 1e-4 * p.standard_error) << i;
      EXPECT_NEAR(estimate->parameters[k].lower, p.lower, 1e-4 * p.standard_error) << i;
    }
  }
  EXPECT_GE(with, 2);
  EXPECT_GE(without, 10);
}

TEST(BiasWatch, LooksAgainWhereTheErrorsGrow) {
  Figure12 rig;
  rig.next();
  RunData quiet = rig.mean;
  Estimator estimator(rig.model, {quiet});
  const RunData exact = (*exact_data(rig.model, {{2.0, 10.0, 40, 1.0}}, testing::kOleoFeet))[0];
  for (std::size_t j = 0; j < quiet.displacement.size(); ++j)
    quiet.displacement[j] =
        exact.displacement[j] + 0.02 * (rig.mean.displacement[j] - exact.displacement[j]);
  BiasWatch watch;
  for (const bool loud : {false, true, false}) {
    estimator.update_run(0, loud ? rig.mean : quiet);
    ASSERT_EQ(estimator.fit(testing::kOleoFeet).status, FitStatus::converged);
    Estimate estimate = estimator.describe();
    EXPECT_TRUE(watch.take_off(estimate, estimator, rig.model));
    EXPECT_EQ(estimate.parameters[3].bias != 0.0, loud);
  }
  // Between small errors, without a jump, no search was needed.
  EXPECT_EQ(watch.looks(), 2);
}

TEST(BiasWatch, LooksAgainWhereTheDamperHasChanged) {
  Figure12 rig;
  std::vector<double> theta = testing::kOleoFeet;
  RunData run = (*exact_data(rig.model, {{2.0, 10.0, 40, 1.0}}, theta))[0];
  Estimator estimator(rig.model, {run});
  BiasWatch watch;
  for (const double share : {1.0, 1.0, 1.3, 1.3}) {
    theta[0] = share * testing::kOleoFeet[0];
    const RunData exact = (*exact_data(rig.model, {{2.0, 10.0, 40, 1.0}}, theta))[0];
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal(0.0, 1e-6);
    for (std::size_t j = 0; j < run.displacement.size(); ++j)
      run.displacement[j] = exact.displacement[j] + normal(random);
    estimator.update_run(0, run);
    ASSERT_EQ(estimator.fit(theta).status, FitStatus::converged);
    Estimate estimate = estimator.describe();
    EXPECT_TRUE(watch.take_off(estimate, estimator, rig.model));
  }
  EXPECT_EQ(watch.looks(), 2);
}

}  // namespace
}  // namespace shaker::estimator::online
