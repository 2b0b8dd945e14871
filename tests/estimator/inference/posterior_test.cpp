#include "estimator/inference/posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gmock/gmock.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr double kSigma = 0.7;

// y = a + b x with known noise: the posterior is normal, with moments from linear algebra.
TEST(Posterior, OfALinearModelHasItsKnownMoments) {
  std::vector<double> x, y;
  double n = 0, sx = 0, sxx = 0, sy = 0, sxy = 0;
  for (int i = 0; i < 12; ++i) {
    x.push_back(0.3 * i + 1.0);
    y.push_back(2.0 - 0.5 * x.back() + 0.4 * std::sin(5.0 * i));
    n += 1.0, sx += x[i], sxx += x[i] * x[i], sy += y[i], sxy += x[i] * y[i];
  }
  const double d = n * sxx - sx * sx;
  const double a = (sxx * sy - sx * sxy) / d, b = (n * sxy - sx * sy) / d;
  const double v = kSigma * kSigma;
  const std::vector<double> covariance = {v * sxx / d, -v * sx / d, -v * sx / d, v * n / d};
  const auto make = [&]() -> LogDensity {
    return [&](std::span<const double> theta) {
      double sum = 0.0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const double e = y[i] - theta[0] - theta[1] * x[i];
        sum += e * e;
      }
      return -0.5 * sum / v;
    };
  };
  // The start covariance is wrong: the rounds must find the right one.
  std::vector<double> guess = covariance;
  for (double& g : guess)
    g *= 3.0;
  const Posterior found = sample_posterior(make, {a, b}, guess);
  EXPECT_TRUE(found.converged) << found.pareto_k;
  const double mean[] = {a, b};
  for (std::size_t k = 0; k < 2; ++k) {
    const double sd = std::sqrt(covariance[3 * k]);
    const PosteriorMarginal& p = found.parameters[k];
    EXPECT_GT(p.effective_samples, 1000.0);
    EXPECT_NEAR(p.mean, mean[k], 4.0 * sd / std::sqrt(p.effective_samples));
    EXPECT_NEAR(p.median, mean[k], 0.08 * sd);
    EXPECT_NEAR(p.standard_deviation / sd, 1.0, 0.06);
    EXPECT_NEAR((p.lower - mean[k]) / sd, -1.96, 0.12);
    EXPECT_NEAR((p.upper - mean[k]) / sd, 1.96, 0.12);
  }
  EXPECT_NEAR(found.covariance[1] / covariance[1], 1.0, 0.1);
}

// y = exp(-t x) with few points and noise: a skew posterior of one parameter, against Simpson's
// rule.
TEST(Posterior, OfASkewOneAgreesWithQuadrature) {
  const auto log_density = [](double t) {
    if (t <= 0.0) return -std::numeric_limits<double>::infinity();
    double sum = 0.0;
    const double y[] = {0.52, 0.05, 0.11};
    for (int i = 0; i < 3; ++i) {
      const double e = y[i] - std::exp(-t * (i + 1));
      sum += e * e;
    }
    return -0.5 * sum / 0.03 - 0.5 * std::log(t) - 2.0 * t;
  };
  double mode = 0.8;
  for (double t = 0.3; t < 2.0; t += 1e-5)
    mode = log_density(t) > log_density(mode) ? t : mode;
  const double h = 1e-3;
  const double bend =
      -(log_density(mode + h) - 2.0 * log_density(mode) + log_density(mode - h)) / (h * h);
  constexpr int kSteps = 200000;
  constexpr double kFrom = 1e-9, kTo = 40.0;
  double whole = 0.0, first = 0.0, second = 0.0;
  std::vector<double> cumulative;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = kFrom + (kTo - kFrom) * i / kSteps;
    const double weight = (i == 0 || i == kSteps ? 1.0
                           : i % 2 == 1          ? 4.0
                                                 : 2.0) *
                          std::exp(log_density(t) - log_density(mode));
    whole += weight;
    first += weight * t;
    second += weight * t * t;
    cumulative.push_back(whole);
  }
  const double mean = first / whole, sd = std::sqrt(second / whole - mean * mean);
  const auto quantile = [&](double p) {
    const auto at = std::lower_bound(cumulative.begin(), cumulative.end(), p * whole);
    return kFrom + (kTo - kFrom) * static_cast<double>(at - cumulative.begin()) / kSteps;
  };
  ASSERT_GT(mean - mode, 0.1 * sd) << "the case is not skew";
  PosteriorOptions options;
  options.samples = 8000;
  const Posterior found = sample_posterior(
      [&]() -> LogDensity { return [&](std::span<const double> t) { return log_density(t[0]); }; },
      {mode}, {1.0 / bend}, options);
  const PosteriorMarginal& p = found.parameters[0];
  EXPECT_TRUE(found.converged) << found.pareto_k << " " << found.effective_samples;
  EXPECT_NEAR(p.mean, mean, 0.04 * sd);
  EXPECT_NEAR(p.standard_deviation / sd, 1.0, 0.06);
  EXPECT_NEAR(p.median, quantile(0.5), 0.04 * sd);
  EXPECT_NEAR(p.lower, quantile(0.025), 0.05 * sd);
  EXPECT_NEAR(p.upper, quantile(0.975), 0.25 * sd);
}

// Tails like 1 / t^1.3: against them no proposal of this kind has a finite variance.
TEST(Posterior, SaysWhenItsTailIsTooHeavy) {
  const Posterior found = sample_posterior(
      []() -> LogDensity {
        return [](std::span<const double> t) {
          return -0.65 * std::log1p(1e4 * t[0] * t[0]) - 0.65 * std::log1p(1e4 * t[1] * t[1]) -
                 0.65 * std::log1p(1e4 * t[2] * t[2]);
        };
      },
      {0.0, 0.0, 0.0}, {1e-6, 0, 0, 0, 1e-6, 0, 0, 0, 1e-6}, {.samples = 500, .rounds = 1});
  EXPECT_FALSE(found.converged);
  Estimate estimate;
  replace_by_posterior(estimate, found);
  ASSERT_EQ(estimate.warnings.size(), 1U);
  EXPECT_THAT(estimate.warnings[0], ::testing::HasSubstr("not converged"));
}

RunData linear_run(double noise) {
  const Model model(testing::linear_oscillator());
  PeriodicSystem system(model, {Scheme::order6, 160, true});
  system.set_excitation(2.0, 3.0);
  EXPECT_EQ(system.solve_from_rest({{2.0, 120.0}}).status, SolveStatus::converged);
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 3.0;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 40; ++i)
    run.displacement.push_back(system.value(4 * i, 0) + noise * normal(random));
  return run;
}

// With little noise (6.2) is linear in its parameters: Student's t of (3.27), (3.28).
TEST(Posterior, OfTheLinearOscillatorIsStudentsT) {
  const Model model(testing::linear_oscillator());
  const std::vector<RunData> runs = {linear_run(1e-5)};
  Estimator estimator(model, runs);
  const Fit& fit = estimator.fit({2.1, 118.0});
  ASSERT_EQ(fit.status, FitStatus::converged);
  PosteriorOptions few;
  few.samples = 2000;
  few.rounds = 2;
  few.threads = 1;
  const Posterior found = posterior(model, estimator, runs, {}, few);
  ASSERT_TRUE(found.converged);
  for (std::size_t k = 0; k < 2; ++k) {
    const PosteriorMarginal& p = found.parameters[k];
    const double error = fit.standard_error[k];
    EXPECT_NEAR(p.mean, fit.theta[k], 0.1 * error);
    EXPECT_NEAR(p.lower, fit.theta[k] - fit.quantile * error, 0.25 * error);
    EXPECT_NEAR(p.upper, fit.theta[k] + fit.quantile * error, 0.25 * error);
  }
  few.threads = 3;
  const Posterior again = posterior(model, estimator, runs, {}, few);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(again.parameters[k].mean, found.parameters[k].mean);
    EXPECT_EQ(again.parameters[k].upper, found.parameters[k].upper);
  }
}

// Known noise and a prior as sharp as the data: precisions add, and means are weighted by them.
TEST(Posterior, CountsPriors) {
  auto spec = testing::linear_oscillator();
  const std::vector<RunData> runs = {linear_run(1e-5)};
  EstimationOptions known;
  known.noise = 1e-5;
  const Model plain(spec);
  Estimator first(plain, runs, known);
  const Fit fit = first.fit({2.1, 118.0});
  const double mean = fit.theta[0] + 2.0 * fit.standard_error[0];
  spec.effects[0].parameters[plain.parameters()[0].name].prior_mean = mean;
  spec.effects[0].parameters[plain.parameters()[0].name].prior_standard_deviation =
      fit.standard_error[0];
  const Model model(spec);
  Estimator estimator(model, runs, known);
  const Fit& with = estimator.fit({2.1, 118.0});
  ASSERT_EQ(with.status, FitStatus::converged);
  PosteriorOptions few;
  few.samples = 2000;
  few.rounds = 2;
  const Posterior found = posterior(model, estimator, runs, known, few);
  ASSERT_TRUE(found.converged);
  EXPECT_NEAR(found.parameters[0].mean, fit.theta[0] + fit.standard_error[0],
              0.1 * fit.standard_error[0]);
  EXPECT_NEAR(found.parameters[0].standard_deviation, fit.standard_error[0] / std::numbers::sqrt2,
              0.06 * fit.standard_error[0]);
}

}  // namespace
}  // namespace shaker::estimator
