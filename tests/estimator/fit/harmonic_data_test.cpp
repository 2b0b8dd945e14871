#include "estimator/fit/harmonic_data.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <stdexcept>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;
constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kFrequency = 1.0, kAmplitude = 2.0, kDamping = 3.0, kStiffness = 60.0;
constexpr int kPoints = 64;

// u'' + c u' + k (u - u0) = A cos(2 pi f t): the response in closed form.
std::complex<double> response(double c, double k) {
  const double omega = kTwoPi * kFrequency;
  return kAmplitude / std::complex<double>(k - omega * omega, c * omega);
}

std::vector<double> true_period() {
  std::vector<double> u;
  for (int i = 0; i < kPoints; ++i)
    u.push_back((response(kDamping, kStiffness) * std::polar(1.0, kTwoPi * i / kPoints)).real());
  return u;
}

// One cycle with first-order autoregressive noise, like the noise of a resampled record.
std::vector<double> coloured_cycle(std::mt19937_64& random, double deviation, double memory) {
  std::normal_distribution<double> normal(0.0, deviation);
  std::vector<double> u = true_period();
  double state = normal(random) / std::sqrt(1.0 - memory * memory);
  for (double& value : u) {
    value += state;
    state = memory * state + normal(random);
  }
  return u;
}

RunData empty_run() {
  RunData run;
  run.frequency_hz = kFrequency;
  run.amplitude = kAmplitude;
  return run;
}

RunData harmonic_run(std::mt19937_64& random, int cycles, std::size_t count, double memory) {
  HarmonicMean mean(count);
  for (int i = 0; i < cycles; ++i)
    mean.add(coloured_cycle(random, 1e-4, memory));
  RunData run = empty_run();
  mean.into(run);
  return run;
}

EstimationOptions options() {
  EstimationOptions o;
  o.grid.points = 64;
  return o;
}

TEST(HarmonicMean, GivesMeanAndCovarianceAsTheTextbookFormulas) {
  std::mt19937_64 random(1);
  std::vector<std::vector<double>> all;
  HarmonicMean mean(5);
  for (int i = 0; i < 7; ++i) {
    const auto cycle = coloured_cycle(random, 1e-2, 0.5);
    mean.add(cycle);
    all.push_back(fourier_coefficients(cycle, 5));
  }
  std::vector<double> average(5, 0.0);
  for (const auto& c : all)
    for (int j = 0; j < 5; ++j)
      average[j] += c[j] / 7.0;
  const auto covariance = mean.covariance();
  for (int j = 0; j < 5; ++j) {
    EXPECT_NEAR(mean.mean()[j], average[j], 1e-15);
    for (int k = 0; k < 5; ++k) {
      double sum = 0.0;
      for (const auto& c : all)
        sum += (c[j] - average[j]) * (c[k] - average[k]);
      EXPECT_NEAR(covariance[j * 5 + k], sum / 6.0 / 7.0, 1e-18);
    }
  }
  const auto clean = fourier_coefficients(true_period(), 5);
  const auto want = response(kDamping, kStiffness);
  EXPECT_NEAR(clean[0], 0.0, 1e-16);
  EXPECT_NEAR(clean[1], want.real(), 1e-15);
  EXPECT_NEAR(clean[2], -want.imag(), 1e-15);
}

TEST(HarmonicMean, SaysHowManyCoefficientsItsCyclesCanWeigh) {
  EXPECT_EQ(coefficients_for(100, 8), 17U);
  EXPECT_EQ(coefficients_for(20, 8), 9U);
  EXPECT_EQ(coefficients_for(8, 8), 3U);
  EXPECT_LT(coefficients_for(4, 8), 3U);
}

// At the optimum J^T S^-1 (c - model) = 0, and the covariance is (J^T S^-1 J)^-1 times Rao's
// factors; all are calculated here from the closed-form response.
TEST(HarmonicData, IsFittedByGeneralisedLeastSquares) {
  std::mt19937_64 random(2);
  const RunData run = harmonic_run(random, 30, 7, 0.9);
  const Model model(testing::linear_oscillator());
  Estimator estimator(model, {run}, options());
  const Fit& fit = estimator.fit({2.0, 50.0});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;

  const auto coefficients = [](double c, double k) {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(7);
    out[1] = response(c, k).real();
    out[2] = -response(c, k).imag();
    return out;
  };
  Eigen::MatrixXd jacobian(7, 2);
  const double h = 1e-4;
  jacobian.col(0) = (coefficients(fit.theta[0] + h, fit.theta[1]) -
                     coefficients(fit.theta[0] - h, fit.theta[1])) /
                    (2 * h);
  jacobian.col(1) = (coefficients(fit.theta[0], fit.theta[1] + h) -
                     coefficients(fit.theta[0], fit.theta[1] - h)) /
                    (2 * h);
  const Eigen::MatrixXd weight =
      Eigen::Map<const Eigen::MatrixXd>(run.harmonic_covariance.data(), 7, 7).inverse();
  const Eigen::VectorXd left = Eigen::Map<const Eigen::VectorXd>(run.harmonics.data(), 7) -
                               coefficients(fit.theta[0], fit.theta[1]);
  const Eigen::MatrixXd inverse = (jacobian.transpose() * weight * jacobian).inverse();
  const Eigen::VectorXd step = inverse * jacobian.transpose() * weight * left;
  EXPECT_NEAR(step[0], 0.0, 1e-6);
  EXPECT_NEAR(step[1], 0.0, 1e-6);
  const double t2 = left.dot(weight * left);
  EXPECT_NEAR(fit.sum_of_squares, t2, 1e-6 * t2);
  const double nu = 29.0, surplus = 5.0;
  const double rao = nu / (nu - surplus) * (1.0 + t2 / nu);
  EXPECT_NEAR(fit.interval_degrees, nu - surplus, 1e-9);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(fit.covariance[k] / (rao * inverse(k / 2, k % 2)), 1.0, 1e-5);
  // The prediction has the form of the data.
  const auto predicted = estimator.predicted(0);
  EXPECT_NEAR(predicted[1], coefficients(fit.theta[0], fit.theta[1])[1], 1e-9);
  // The fit solved the whitened problem.
  const Linearised rows = estimator.linearised();
  double sum = 0.0;
  for (const double r : rows.residual)
    sum += r * r;
  EXPECT_NEAR(sum, t2, 1e-6 * t2);
}

struct Coverage {
  double inside = 0.0, misfit = 0.0;
};

template <class MakeRun>
Coverage coverage(int repetitions, MakeRun make) {
  const Model model(testing::linear_oscillator());
  std::mt19937_64 random(3);
  Coverage c;
  std::unique_ptr<Estimator> estimator;
  for (int i = 0; i < repetitions; ++i) {
    const RunData run = make(random);
    if (!estimator)
      estimator = std::make_unique<Estimator>(model, std::vector{run}, options());
    else
      estimator->update_run(0, run);
    const Fit& fit = estimator->fit({kDamping, kStiffness});
    c.inside += std::fabs(fit.theta[0] - kDamping) < fit.quantile * fit.standard_error[0];
    c.inside += std::fabs(fit.theta[1] - kStiffness) < fit.quantile * fit.standard_error[1];
    c.misfit += fit.lack_of_fit < 0.05;
  }
  c.inside /= 2.0 * repetitions;
  c.misfit /= repetitions;
  return c;
}

// 24 cycles for 7 coefficients: without Rao's factors these intervals cover 89 %.
TEST(HarmonicData, CoversTheTruthWithColouredNoiseAndFewCycles) {
  const Coverage got =
      coverage(1500, [](auto& random) { return harmonic_run(random, 24, 7, 0.9); });
  EXPECT_NEAR(got.inside, 0.95, 0.012);
  EXPECT_NEAR(got.misfit, 0.05, 0.017);
}

// The same noise treated as white shows why harmonics need a covariance.
TEST(HarmonicData, IsNeededBecauseSamplesTakenForWhiteUnderstateTheError) {
  const Coverage got = coverage(300, [](auto& random) {
    RunData run = empty_run();
    run.displacement = coloured_cycle(random, 1e-4, 0.9);
    return run;
  });
  EXPECT_LT(got.inside, 0.75);
}

TEST(HarmonicData, DoesTheSameOnAnOleo) {
  const Model model(testing::oleo());
  PeriodicSystem system(model, {Scheme::order6, 320, true});
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(0.0, 2e-5);
  std::vector<RunData> runs;
  for (const double frequency : {1.0, 2.0}) {
    system.set_excitation(frequency, 3.048);
    system.solve_from_rest(testing::kOleoSi);
    HarmonicMean mean(11);
    std::vector<double> cycle(64);
    for (int c = 0; c < 40; ++c) {
      double drift = normal(random);
      for (int i = 0; i < 64; ++i)
        cycle[i] = system.value(5 * i, 0) + (drift = 0.8 * drift + normal(random));
      mean.add(cycle);
    }
    RunData run;
    run.frequency_hz = frequency;
    run.amplitude = 3.048;
    mean.into(run);
    runs.push_back(run);
  }
  Estimator estimator(model, runs);
  const Fit& fit = estimator.fit({13.3, 1.3, 4.5, 1.1});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  for (int k = 0; k < 4; ++k)
    EXPECT_LT(std::fabs(fit.theta[k] - testing::kOleoSi[k]), 3.5 * fit.standard_error[k]) << k;
  EXPECT_GT(fit.lack_of_fit, 1e-3);
  EXPECT_TRUE(estimator.describe().usable);
}

TEST(HarmonicData, ShowsAModelThatLacksAnEffect) {
  std::mt19937_64 random(5);
  auto run = harmonic_run(random, 40, 7, 0.9);
  run.harmonics[5] += 30.0 * std::sqrt(run.harmonic_covariance[5 * 7 + 5]);
  const Model model(testing::linear_oscillator());
  Estimator estimator(model, {run}, options());
  EXPECT_LT(estimator.fit({kDamping, kStiffness}).lack_of_fit, 1e-9);
}

TEST(HarmonicData, IsRefusedWithASentenceWhenItCannotBeUsed) {
  const Model model(testing::linear_oscillator());
  std::mt19937_64 random(6);
  const RunData good = harmonic_run(random, 30, 5, 0.5);
  const auto refusal = [&](std::vector<RunData> runs) {
    try {
      Estimator estimator(model, std::move(runs));
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal({good}), "");
  EXPECT_THAT(refusal({harmonic_run(random, 5, 7, 0.5)}), HasSubstr("add cycles"));
  RunData run = good;
  run.harmonics.pop_back();
  EXPECT_THAT(refusal({run}), HasSubstr("4 Fourier coefficients"));
  run = good;
  run.harmonic_covariance.pop_back();
  EXPECT_THAT(refusal({run}), HasSubstr("needs 25"));
  run = good;
  run.harmonics[0] = std::nan("");
  EXPECT_THAT(refusal({run}), HasSubstr("not finite"));
  run = good;
  run.harmonic_covariance[1] *= 2.0;
  EXPECT_THAT(refusal({run}), HasSubstr("not symmetric"));
  run = empty_run();
  run.displacement = true_period();
  EXPECT_THAT(refusal({good, run}), HasSubstr("run 2 has samples"));
}

}  // namespace
}  // namespace shaker::estimator
