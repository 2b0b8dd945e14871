// Normal priors (3.8).
#include <cmath>
#include <random>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "estimator/fit/estimation.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

RunData oscillator_run(unsigned seed, double noise_deviation) {
  const Model truth(testing::linear_oscillator());
  PeriodicSystem system(truth, {Scheme::fourier, 64, false});
  system.set_excitation(1.0, 2.0);
  system.solve_from_rest(std::vector<double>{3.0, 60.0});
  RunData run;
  run.frequency_hz = 1.0;
  run.amplitude = 2.0;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, noise_deviation);
  for (int i = 0; i < 64; ++i)
    run.displacement.push_back(system.value(i, 0) + noise(random));
  return run;
}

config::ModelSpec with_prior(double mean, double deviation) {
  auto spec = testing::linear_oscillator();
  spec.effects[1].parameters["k"].prior_mean = mean;
  spec.effects[1].parameters["k"].prior_standard_deviation = deviation;
  return spec;
}

// The product of two normal densities: precisions add, and means are weighted by them.
class Prior : public ::testing::TestWithParam<Method> {};
TEST_P(Prior, MultipliesTheLikelihood) {
  const RunData run = oscillator_run(1, 1e-4);
  EstimationOptions options;
  options.method = GetParam();
  options.noise = 1e-4;
  const Model plain(testing::linear_oscillator());
  Estimator least_squares(plain, {run}, options);
  const Fit alone = least_squares.fit({2.0, 50.0});
  const double deviation = 0.7 * alone.standard_error[1];
  const double mean = alone.theta[1] + 1.5 * deviation;
  const Model informed(with_prior(mean, deviation));
  Estimator posterior(informed, {run}, options);
  const Fit fit = posterior.fit({2.0, 50.0});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  const Eigen::Matrix2d information =
      Eigen::Map<const Eigen::Matrix2d>(alone.covariance.data()).inverse();
  Eigen::Matrix2d precision = Eigen::Matrix2d::Zero();
  precision(1, 1) = 1.0 / (deviation * deviation);
  const Eigen::Matrix2d covariance = (information + precision).inverse();
  const Eigen::Vector2d want =
      covariance * (information * Eigen::Vector2d(alone.theta[0], alone.theta[1]) +
                    precision * Eigen::Vector2d(0.0, mean));
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(fit.theta[k], want[k], 1e-3 * alone.standard_error[k]);
    EXPECT_NEAR(fit.standard_error[k] / std::sqrt(covariance(k, k)), 1.0, 1e-3);
  }
}
INSTANTIATE_TEST_SUITE_P(Methods, Prior,
                         ::testing::Values(Method::lifted, Method::gauss_newton,
                                           Method::levenberg_marquardt));

TEST(Prior, IsWeighedAgainstTheNoiseThatTheResidualsShow) {
  const RunData run = oscillator_run(2, 1e-4);
  EstimationOptions unknown;
  const Model model(with_prior(62.0, 0.05));
  Estimator estimator(model, {run}, unknown);
  const Fit fit = estimator.fit({2.0, 50.0});
  ASSERT_EQ(fit.status, FitStatus::converged);
  EstimationOptions known;
  known.noise = fit.noise;
  Estimator again(model, {run}, known);
  const Fit same = again.fit({2.0, 50.0});
  EXPECT_NEAR(fit.theta[0], same.theta[0], 1e-7);
  EXPECT_NEAR(fit.theta[1], same.theta[1], 1e-6);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(fit.covariance[i], same.covariance[i],
                1e-6 * fit.standard_error[i / 2] * fit.standard_error[i % 2]);
}

TEST(Prior, DeterminesWhatTheDataLeaveOpen) {
  auto spec =
      testing::model_of({testing::effect("viscous_damping"), testing::effect("viscous_damping"),
                         testing::effect("linear_stiffness")});
  spec.effects[0].parameters["c"].prior_mean = 1.0;
  spec.effects[0].parameters["c"].prior_standard_deviation = 0.2;
  const Model model(spec);
  Estimator estimator(model, {oscillator_run(3, 1e-4)});
  const Fit& fit = estimator.fit({0.5, 1.0, 50.0});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  EXPECT_NEAR(fit.theta[0], 1.0, 1e-6);
  EXPECT_NEAR(fit.theta[1], 2.0, 0.1);
  EXPECT_NEAR(fit.standard_error[0], 0.2, 1e-6);
  EXPECT_TRUE(estimator.describe().usable);
}

TEST(Prior, CountsForTheOleoAndForTheOleoOnItsTyre) {
  for (const bool tyre : {false, true}) {
    auto spec = tyre ? testing::oleo_on_tyre(0.1) : testing::oleo();
    auto truth = testing::kOleoSi;
    if (tyre) {
      truth.push_back(900.0);
      truth.push_back(2.0);
      spec.effects[3].parameters["k"].start = 850.0;
    }
    // A prior on theta4 that is much sharper than the data.
    spec.effects[1].parameters["theta4"].prior_mean = 1.1;
    spec.effects[1].parameters["theta4"].prior_standard_deviation = 1e-6;
    const Model model(spec);
    PeriodicSystem system(model, {Scheme::order6, 160, true});
    system.set_excitation(2.0, 3.048);
    ASSERT_EQ(system.solve_from_rest(truth).status, SolveStatus::converged);
    RunData run;
    run.frequency_hz = 2.0;
    run.amplitude = 3.048;
    std::mt19937_64 random(4);
    std::normal_distribution<double> noise(0.0, 1e-4);
    for (int i = 0; i < 40; ++i)
      run.displacement.push_back(system.value(4 * i, 0) + noise(random));
    Estimator estimator(model, {run});
    const Fit& fit = estimator.fit(truth);
    ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
    EXPECT_NEAR(fit.theta[3], 1.1, 1e-4);
    EXPECT_NEAR(fit.standard_error[3], 1e-6, 1e-8);
  }
}

}  // namespace
}  // namespace shaker::estimator
