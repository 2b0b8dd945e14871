#include "estimator/fit/objectives/robust.hpp"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr double kNoise = 1e-4;

std::vector<double> period(const Model& model, const std::vector<double>& theta) {
  PeriodicSystem system(model, {Scheme::order6, 320, true});
  system.set_excitation(2.0, 10.0);
  if (system.solve_from_rest(theta).status != SolveStatus::converged)
    throw std::runtime_error("no periodic solution");
  std::vector<double> u;
  for (int i = 0; i < 64; ++i)
    u.push_back(system.value(5 * i, 0));
  return u;
}

RunData noisy_run(const Model& model, std::mt19937_64& random) {
  static const std::vector<double> exact = period(model, testing::kOleoFeet);
  std::normal_distribution<double> normal(0.0, kNoise);
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 10.0;
  run.displacement = exact;
  for (double& u : run.displacement)
    u += normal(random);
  return run;
}

class Robust : public ::testing::TestWithParam<Loss> {};

TEST_P(Robust, IsNotPulledByOutliersAndNamesThem) {
  const Model model(testing::oleo(32.178));
  std::mt19937_64 random(1);
  RunData run = noisy_run(model, random);
  for (const int j : {5, 30, 47})
    run.displacement[static_cast<std::size_t>(j)] += 100.0 * kNoise;
  Estimator plain(model, {run});
  const Fit squares = plain.fit(testing::kOleoFeet);
  const RobustFit robust = fit_robust(model, {run}, testing::kOleoFeet, GetParam());
  ASSERT_EQ(robust.fit.status, FitStatus::converged);
  ASSERT_EQ(robust.outliers.size(), 3U);
  EXPECT_NEAR(robust.scale, kNoise, 0.4 * kNoise);
  double worse = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double off = std::fabs(robust.fit.theta[k] - testing::kOleoFeet[k]);
    EXPECT_LT(off, 4.0 * robust.fit.standard_error[k]) << k;
    worse = std::max(worse, std::fabs(squares.theta[k] - testing::kOleoFeet[k]) / off);
  }
  EXPECT_GT(worse, 2.0);
}

// sum psi(e / s) de/dtheta = 0; the derivatives are differences of whole periodic solutions.
TEST_P(Robust, StandsWhereTheSumOfInfluencesVanishes) {
  const Model model(testing::oleo(32.178));
  std::mt19937_64 random(2);
  RunData run = noisy_run(model, random);
  run.displacement[10] += 20.0 * kNoise;
  const RobustFit robust = fit_robust(model, {run}, testing::kOleoFeet, GetParam());
  const auto psi = [](double z) {
    switch (GetParam()) {
      case Loss::huber:
        return std::clamp(z, -1.345, 1.345);
      case Loss::cauchy:
        return z / (1.0 + z * z / (2.385 * 2.385));
      default: {
        const double d = 1.0 - z * z / (4.685 * 4.685);
        return d > 0.0 ? z * d * d : 0.0;
      }
    }
  };
  const auto centre = period(model, robust.fit.theta);
  for (std::size_t k = 0; k < 4; ++k) {
    auto up = robust.fit.theta, down = up;
    const double h = 1e-5 * up[k];
    up[k] += h;
    down[k] -= h;
    const auto high = period(model, up), low = period(model, down);
    double sum = 0.0, size = 0.0;
    for (std::size_t j = 0; j < centre.size(); ++j) {
      const double slope = (high[j] - low[j]) / (2.0 * h);
      const double term = psi((run.displacement[j] - centre[j]) / robust.scale) * slope;
      sum += term;
      size += std::fabs(term);
    }
    EXPECT_LT(std::fabs(sum), 1e-4 * size) << k;
  }
}

TEST_P(Robust, CoversTheTruthOnNormalNoise) {
  const Model model(testing::oleo(32.178));
  std::mt19937_64 random(3);
  constexpr int kRepetitions = 200;
  int inside = 0;
  for (int i = 0; i < kRepetitions; ++i) {
    const RobustFit r =
        fit_robust(model, {noisy_run(model, random)}, testing::kOleoFeet, GetParam());
    ASSERT_EQ(r.fit.status, FitStatus::converged);
    for (std::size_t k = 0; k < 4; ++k)
      inside += std::fabs(r.fit.theta[k] - testing::kOleoFeet[k]) <
                r.fit.quantile * r.fit.standard_error[k];
  }
  EXPECT_NEAR(inside / (4.0 * kRepetitions), 0.95, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Losses, Robust, ::testing::Values(Loss::huber, Loss::cauchy, Loss::tukey));

TEST(Robust, RefusesFourierCoefficients) {
  const Model model(testing::linear_oscillator());
  RunData run;
  run.frequency_hz = 1.0;
  run.amplitude = 2.0;
  run.harmonics = {0.0, 0.1, 0.1};
  run.harmonic_covariance = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  EXPECT_THROW(fit_robust(model, {run}, {3.0, 60.0}, Loss::huber), std::invalid_argument);
}

// White: with equal variances the sandwich is the ordinary covariance; with unequal ones it is
// right.
TEST(Sandwich, HoldsWithoutEqualVariances) {
  const Model model(testing::oleo(32.178));
  const auto exact = period(model, testing::kOleoFeet);
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(0.0, kNoise);
  RunData run = noisy_run(model, random);
  Estimator estimator(model, {run});
  constexpr int kRepetitions = 400;
  double scatter = 0.0, ordinary = 0.0, sandwich = 0.0;
  for (int i = 0; i < kRepetitions; ++i) {
    for (std::size_t j = 0; j < 64; ++j)
      run.displacement[j] = exact[j] + (j < 16 ? 5.0 : 1.0) * normal(random);
    estimator.update_run(0, run);
    const Fit& fit = estimator.fit(testing::kOleoFeet);
    scatter += std::pow(fit.theta[0] - testing::kOleoFeet[0], 2) / kRepetitions;
    ordinary += fit.covariance[0] / kRepetitions;
    sandwich += sandwich_covariance(model, estimator)[0] / kRepetitions;
  }
  EXPECT_NEAR(sandwich / scatter, 1.0, 0.25);
  EXPECT_GT(std::fabs(ordinary / scatter - 1.0), std::fabs(sandwich / scatter - 1.0));
}

// (3.15): a weight of two equals the datum given twice; a weight of zero leaves it out.
TEST(SampleWeights, CountASampleSoManyTimes) {
  const Model model(testing::oleo(32.178));
  std::mt19937_64 random(5);
  RunData run = noisy_run(model, random);
  for (std::size_t j = 0; j < 64; ++j)
    run.tau.push_back(static_cast<double>(j) / 64.0);
  RunData twice = run, weighted = run;
  twice.tau.push_back(run.tau[3]);
  twice.displacement.push_back(run.displacement[3]);
  twice.tau.erase(twice.tau.begin() + 20);
  twice.displacement.erase(twice.displacement.begin() + 20);
  weighted.sample_weight.assign(64, 1.0);
  weighted.sample_weight[3] = 2.0;
  weighted.sample_weight[20] = 0.0;
  Estimator a(model, {twice}), b(model, {weighted});
  const Fit& one = a.fit(testing::kOleoFeet);
  const Fit& other = b.fit(testing::kOleoFeet);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(one.theta[k] / other.theta[k], 1.0, 1e-8);
  EXPECT_NEAR(one.sum_of_squares / other.sum_of_squares, 1.0, 1e-8);
}

}  // namespace
}  // namespace shaker::estimator
