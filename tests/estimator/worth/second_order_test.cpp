#include "estimator/worth/second_order.hpp"

#include <cmath>
#include <complex>

#include <gmock/gmock.h>

#include "estimator/worth/monte_carlo.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr double kNoise = 1e-4;

EstimationOptions known(double noise) {
  EstimationOptions options;
  options.noise = noise;
  options.tolerance = 1e-12;
  return options;
}

// Stiffness k of u'' + c u' + k u = A cos(wt): u = A / (k - w^2 + i c w), whose derivatives over k
// are known; sums over the points of a period are n / 2 times products of amplitudes.
TEST(SecondOrder, OfOneParameterIsTheClosedForm) {
  auto spec = testing::linear_oscillator();
  const Model all(spec);
  spec.effects[0].parameters[all.parameters()[0].name].fixed = true;
  spec.effects[0].parameters[all.parameters()[0].name].start = 3.0;
  const Model model(spec);
  const std::vector<double> truth = {3.0, 60.0};
  const auto data = exact_data(model, {{1.0, 2.0, 40, 1.0}}, truth);
  ASSERT_TRUE(data);
  constexpr double kLoud = 5e-3;
  Estimator estimator(model, *data, known(kLoud));
  ASSERT_EQ(estimator.fit(truth).status, FitStatus::converged);
  const auto found = second_order(estimator, model);
  ASSERT_TRUE(found);
  const double omega = 2.0 * M_PI;
  const std::complex<double> z(60.0 - omega * omega, 3.0 * omega);
  const std::complex<double> slope = -2.0 / (z * z), bend = 4.0 / (z * z * z);
  const double jj = 20.0 * std::norm(slope) / (kLoud * kLoud);
  const double jh = 20.0 * std::real(std::conj(slope) * bend) / (kLoud * kLoud);
  const double hh = 20.0 * std::norm(bend) / (kLoud * kLoud);
  EXPECT_NEAR(found->bias[1] / (-0.5 * jh / (jj * jj)), 1.0, 1e-3);
  EXPECT_EQ(found->bias[0], 0.0);
  const double second = 1.0 / std::sqrt(jj - jh * jh / (hh + 2.0 * jj * jj));
  EXPECT_GT(second * std::sqrt(jj), 1.0001) << "the case is too straight to show anything";
  EXPECT_NEAR(found->bound[1] / second, 1.0, 1e-5);
}

// The bias is what the estimate's second derivatives over the data make of their variance:
// differences of estimates, datum by datum, know nothing of the formula.
void expect_bias_of_differences(const Model& model, const std::vector<RunDesign>& design,
                                const std::vector<double>& truth, int grid, double tolerance) {
  const auto data = exact_data(model, design, truth);
  ASSERT_TRUE(data);
  EstimationOptions options = known(kNoise);
  options.grid.points = grid;
  Estimator estimator(model, *data, options);
  const Fit centre = estimator.fit(truth);
  ASSERT_EQ(centre.status, FitStatus::converged);
  const auto found = second_order(estimator, model);
  ASSERT_TRUE(found);
  std::vector<double> sum(truth.size(), 0.0);
  constexpr double kSteps = 2.0;  // of the noise
  for (std::size_t r = 0; r < data->size(); ++r) {
    for (std::size_t j = 0; j < (*data)[r].displacement.size(); ++j) {
      for (const double side : {-kSteps, kSteps}) {
        RunData moved = (*data)[r];
        moved.displacement[j] += side * kNoise;
        estimator.update_run(r, moved);
        const Fit& fit = estimator.fit(centre.theta);
        ASSERT_EQ(fit.status, FitStatus::converged);
        for (std::size_t k = 0; k < sum.size(); ++k)
          sum[k] += 0.5 * (fit.theta[k] - centre.theta[k]) / (kSteps * kSteps);
      }
      estimator.update_run(r, (*data)[r]);
    }
  }
  double largest = 0.0;
  for (std::size_t k = 0; k < sum.size(); ++k) {
    EXPECT_NEAR(found->bias[k], sum[k], tolerance * centre.standard_error[k]) << k;
    largest = std::max(largest, std::fabs(sum[k]) / centre.standard_error[k]);
  }
  EXPECT_GT(largest, 10.0 * tolerance) << "the case has too little bias to show anything";
  EXPECT_NEAR(found->largest_bias, largest, 2.0 * tolerance);
}

TEST(SecondOrder, BiasIsThatOfTheOleo) {
  expect_bias_of_differences(Model(testing::oleo(32.178)), {{2.0, 10.0, 40, 1.0}},
                             testing::kOleoFeet, 160, 1e-5);
}

TEST(SecondOrder, BiasIsThatOfTheOleoOnItsTyre) {
  std::vector<double> truth = testing::kOleoSi;
  truth.push_back(900.0);
  truth.push_back(2.0);
  expect_bias_of_differences(Model(testing::oleo_on_tyre(0.1)),
                             {{1.5, 3.048, 16, 1.0}, {3.0, 3.048, 16, 1.0}}, truth, 160, 1e-3);
}

// Figure 12 of the paper, 2000 repetitions of the same noise with and without (10 000 in
// docs/estimation.md): the bias goes, and with it the scatter above the bound of second order.
TEST(SecondOrder, CorrectionTakesBiasAndScatterOffFigure12) {
  const Model model(testing::oleo(32.178));
  MonteCarloOptions options;
  options.runs = {{2.0, 10.0, 40, 1.0}};
  options.truth = testing::kOleoFeet;
  options.noise = 0.01 * 0.5698 / std::sqrt(3.0);
  options.kind = NoiseKind::uniform;
  options.replications = 2000;
  const auto plain = monte_carlo(model, options);
  options.unbiased = true;
  const auto better = monte_carlo(model, options);
  ASSERT_TRUE(plain && better);
  EXPECT_EQ(better->uncorrected, 0);
  for (int k = 0; k < 4; ++k) {
    const ParameterScore& p = better->parameters[k];
    EXPECT_LT(std::fabs(p.bias / p.bound), 0.07) << k;  // three standard errors of the mean
    EXPECT_NEAR(p.coverage, 0.95, 0.02) << k;
    EXPECT_GE(p.second_bound, p.bound);
    if (k < 2) continue;
    EXPECT_GT(std::fabs(plain->parameters[k].bias / p.bound), 0.07);
    EXPECT_LT(p.scatter, 0.98 * plain->parameters[k].scatter);
  }
}

TEST(SecondOrder, LeavesTheBiasOfFigure13InAndSaysSo) {
  const Model model(testing::oleo(32.178));
  const auto data = exact_data(model, {{2.0, 5.0, 40, 1.0}}, testing::kOleoFeet);
  ASSERT_TRUE(data);
  Estimator estimator(model, *data, known(0.01 * 0.5488 / std::sqrt(3.0)));
  Fit fit = estimator.fit(testing::kOleoFeet);
  const auto found = second_order(estimator, model);
  ASSERT_TRUE(found);
  EXPECT_GT(found->largest_bias, kLargestBias);
  const std::vector<double> before = fit.theta;
  EXPECT_FALSE(take_off_bias(fit, found));
  EXPECT_EQ(fit.theta, before);
  Estimate estimate = estimator.describe();
  const double value = estimate.parameters[3].value;
  take_off_bias(estimate, found);
  EXPECT_EQ(estimate.parameters[3].value, value);
  EXPECT_THAT(estimate.warnings, ::testing::Contains(::testing::HasSubstr("left in")));
}

}  // namespace
}  // namespace shaker::estimator
