#include "estimator/diagnosis/select/internal/weighed_again.hpp"

#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/diagnosis/noise/internal/extra_channels.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kDamping = 8.0, kStiffness = 100.0;

// A linear oscillator in closed form with its load cell, near its resonance.
std::vector<SteadyRun> measured() {
  std::mt19937_64 source(3);
  std::normal_distribution<double> normal;
  const std::complex<double> i(0.0, 1.0);
  std::vector<SteadyRun> runs;
  for (const double frequency : {1.2, 1.7, 2.3}) {
    Recording r;
    r.name = "r" + std::to_string(runs.size());
    r.frequency_hz = frequency;
    const double omega = 2.0 * std::numbers::pi * frequency;
    const std::complex<double> u = 2.0 / (kStiffness - omega * omega + i * omega * kDamping);
    for (int n = 0; n < 12 * 150; ++n) {
      const std::complex<double> turn = std::exp(i * (omega * n / (150.0 * frequency)));
      r.t.push_back(n / (150.0 * frequency));
      r.excitation.push_back((2.0 * turn).real());
      r.displacement.push_back((u * turn).real() + 1e-5 * normal(source));
      r.force.push_back(((kStiffness + i * omega * kDamping) * u * turn).real() +
                        5e-3 * normal(source));
    }
    runs.push_back(steady_cycles(r).value());
  }
  return runs;
}

// A model of the spring alone, with weak damping at a fixed value; the damper is missing.
config::ModelSpec spring_alone() {
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 1.0;
  model.effects[0].parameters["c"].fixed = true;
  model.effects[1].parameters["k"].start = kStiffness;
  return model;
}

// The base model was not fitted to the load cell. A refit must not use it either, although it
// would change the result.
TEST(WeighedAgain, KeepsToTheChannelsThatTheBaseModelWasFittedTo) {
  const std::vector<SteadyRun> runs = measured();
  const config::ModelSpec base = spring_alone();
  config::ModelSpec damped = base;
  damped.effects[0].parameters["c"].fixed = false;
  FitOptions far;
  far.from_rest = true;
  const std::vector<RunDatum> data = weigh(runs).data;
  const HarmonicFit fit = fit_harmonics(base, data, {}, nullptr, far);
  Hypothesis guide;
  guide.effects = {"viscous_damping"};
  guide.fit = std::make_shared<const HarmonicFit>(fit_harmonics(damped, data, {}, nullptr, far));
  ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
  ASSERT_TRUE(guide.fit->trouble.empty()) << guide.fit->trouble;
  std::vector<std::string> told;
  const std::vector<RunDatum> taken = extra_channels(runs, *guide.fit, data, told);
  ASSERT_EQ(taken.size(), runs.size());

  EXPECT_TRUE(same_channels(runs, *guide.fit, data, data).empty());
  std::vector<RunDatum> both = data;
  both.insert(both.end(), taken.begin(), taken.end());
  const std::vector<RunDatum> same = same_channels(runs, fit, data, both);
  ASSERT_EQ(same.size(), taken.size());
  for (std::size_t k = 0; k < same.size(); ++k)
    EXPECT_EQ(same[k].quantity, Quantity::damper_force);
  bool cut_short = false;
  const auto again = explained_by_own_errors(
      guide, fit, runs, data, {}, {}, [](double) {}, cut_short);
  EXPECT_FALSE(cut_short);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->data.size(), runs.size());
  EXPECT_EQ(again->found.base.fit->predictions.size(), runs.size());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
