#include "estimator/inference/second_order.hpp"

#include <cmath>
#include <complex>

#include <gmock/gmock.h>

#include "estimator/inference/monte_carlo.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator {
namespace {

constexpr double kOleoNoise = 1e-4;

EstimationOptions known(double noise) {
  EstimationOptions options;
  options.noise = noise;
  options.tolerance = 1e-12;
  return options;
}

// The stiffness k of u'' + c u' + k u = A cos(wt): u = A / (k - w^2 + i c w) has known
// derivatives by k; sums over the points of a period are n / 2 times products of amplitudes.
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

// The bias follows from the second derivatives of the estimate by the data and the variance of
// the data. Differences of estimates, datum by datum, do not use the formula.
void expect_bias_of_differences(const Model& model, const std::vector<RunDesign>& design,
                                const std::vector<double>& truth, int grid, double tolerance) {
  const auto data = exact_data(model, design, truth);
  ASSERT_TRUE(data);
  EstimationOptions options = known(kOleoNoise);
  options.grid.points = grid;
  Estimator estimator(model, *data, options);
  const Fit centre = estimator.fit(truth);
  ASSERT_EQ(centre.status, FitStatus::converged);
  const auto found = second_order(estimator, model);
  ASSERT_TRUE(found);
  std::vector<double> sum(truth.size(), 0.0);
  constexpr double kSteps = 2.0;  // in units of the noise
  for (std::size_t r = 0; r < data->size(); ++r) {
    for (std::size_t j = 0; j < (*data)[r].displacement.size(); ++j) {
      for (const double side : {-kSteps, kSteps}) {
        RunData moved = (*data)[r];
        moved.displacement[j] += side * kOleoNoise;
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

MonteCarloOptions figure_with_noise(double frequency, double amplitude, double noise) {
  MonteCarloOptions options;
  options.runs = {{frequency, amplitude, 40, 1.0}};
  options.truth = testing::kOleoFeet;
  options.noise = noise / std::sqrt(3.0);
  options.kind = NoiseKind::uniform;
  return options;
}

// Figure 12 of the paper with the 10 000 repetitions of docs/estimation.md, with and without
// the correction: it removes the bias and the scatter above the second-order bound. Three
// standard errors of the mean are 0.03.
TEST(SecondOrder, CorrectionTakesBiasAndScatterOffFigure12) {
  const Model model(testing::oleo(32.178));
  auto options = figure_with_noise(2.0, 10.0, 0.01 * 0.5698);
  options.replications = repetitions(10000);
  const auto better = monte_carlo(model, options);
  options.bias = Bias::off;
  const auto plain = monte_carlo(model, options);
  ASSERT_TRUE(plain && better);
  EXPECT_EQ(better->bias_taken_off, options.replications);
  EXPECT_EQ(plain->bias_taken_off, 0);
  if (kSanitized) return;  // too few replications for the checks below
  for (int k = 0; k < 4; ++k) {
    const ParameterScore& p = better->parameters[k];
    EXPECT_LT(std::fabs(p.bias / p.bound), 0.03) << k;
    EXPECT_LT(p.scatter / p.bound, 1.02) << k;
    EXPECT_NEAR(p.coverage, 0.95, 0.01) << k;
    EXPECT_EQ(p.coverage, plain->parameters[k].coverage) << "the interval is the optimum's";
    EXPECT_GE(p.second_bound, p.bound);
    if (k < 2) continue;
    EXPECT_GT(std::fabs(plain->parameters[k].bias / p.bound), 0.07);
    EXPECT_LT(p.scatter, 0.98 * plain->parameters[k].scatter);
  }
}

// A fitted record of this case, with its second-order effects.
struct Bent {
  Bent(double amplitude, double noise)
      : model(testing::oleo(32.178)),
        estimator(model, *exact_data(model, {{2.0, amplitude, 40, 1.0}}, testing::kOleoFeet),
                  known(noise / std::sqrt(3.0))),
        fit(estimator.fit(testing::kOleoFeet)),
        effect(second_order(estimator, model)) {}
  Model model;
  Estimator estimator;
  Fit fit;
  std::optional<SecondOrder> effect;
};

TEST(SecondOrder, PublishedValuesMoveInsideTheOptimumsInterval) {
  Bent figure12(10.0, 0.01 * 0.5698);
  const Estimate plain = figure12.estimator.describe();
  const Estimate estimate = published(figure12.estimator, figure12.model);
  EXPECT_EQ(published(figure12.estimator, figure12.model, Bias::off).parameters[3].value,
            plain.parameters[3].value);
  for (std::size_t k = 0; k < 4; ++k) {
    const ParameterEstimate& p = estimate.parameters[k];
    EXPECT_NE(p.bias, 0.0);
    EXPECT_EQ(p.value, plain.parameters[k].value - p.bias);
    EXPECT_EQ(p.lower, plain.parameters[k].lower);
    EXPECT_EQ(p.upper, plain.parameters[k].upper);
  }
  EXPECT_TRUE(estimate.warnings == plain.warnings);
}

TEST(SecondOrder, LeavesTheOptimumWhereTheBiasIsLostInTheScatter) {
  Bent figure11(10.0, 0.001 * 0.5698);
  ASSERT_TRUE(figure11.effect);
  EXPECT_LT(figure11.effect->largest_bias, kSmallestBias);
  Fit fit = figure11.fit;
  EXPECT_EQ(take_off_bias(fit, figure11.effect, Bias::automatic), Correction::none);
  EXPECT_EQ(fit.theta, figure11.fit.theta);
  EXPECT_EQ(take_off_bias(fit, figure11.effect, Bias::always), Correction::taken_off);
  EXPECT_NE(fit.theta, figure11.fit.theta);
}

TEST(SecondOrder, LeavesTheBiasOfFigure13InAndSaysSo) {
  Bent figure13(5.0, 0.01 * 0.5488);
  ASSERT_TRUE(figure13.effect);
  EXPECT_GT(figure13.effect->largest_bias, kLargestBias);
  Fit fit = figure13.fit;
  EXPECT_EQ(take_off_bias(fit, figure13.effect, Bias::automatic), Correction::left_in);
  EXPECT_EQ(fit.theta, figure13.fit.theta);
  Estimate estimate = figure13.estimator.describe();
  const double value = estimate.parameters[3].value;
  take_off_bias(estimate, figure13.effect, Bias::automatic);
  EXPECT_EQ(estimate.parameters[3].value, value);
  EXPECT_THAT(estimate.warnings, ::testing::Contains(::testing::HasSubstr("left in")));
  take_off_bias(estimate, figure13.effect, Bias::always);
  EXPECT_NE(estimate.parameters[3].value, value);
  EXPECT_THAT(estimate.warnings, ::testing::Contains(::testing::HasSubstr("more than its series")));
}

TEST(SecondOrder, NeverMovesAnEstimateOutOfItsBounds) {
  auto spec = testing::oleo(32.178);
  const Bent free(10.0, 0.01 * 0.5698);
  ASSERT_GT(free.effect->bias[3], 0.0);
  spec.effects[1].parameters["theta4"].lower = free.fit.theta[3] - 0.5 * free.effect->bias[3];
  const Model model(spec);
  Estimator estimator(model, *exact_data(model, {{2.0, 10.0, 40, 1.0}}, testing::kOleoFeet),
                      known(0.01 * 0.5698 / std::sqrt(3.0)));
  Fit fit = estimator.fit(testing::kOleoFeet);
  const auto effect = second_order(estimator, model);
  ASSERT_TRUE(effect);
  const std::vector<double> before = fit.theta;
  for (const Bias rule : {Bias::automatic, Bias::always})
    EXPECT_EQ(take_off_bias(fit, effect, rule), Correction::left_in);
  EXPECT_EQ(fit.theta, before);
  EXPECT_THAT(published(estimator, model).warnings,
              ::testing::Contains(::testing::HasSubstr("beyond a bound")));
}

TEST(SecondOrder, KnowsItsRulesByName) {
  for (const Bias rule : {Bias::automatic, Bias::off, Bias::always})
    EXPECT_EQ(bias_from_name(name(rule)), rule);
  EXPECT_EQ(bias_from_name("auto"), Bias::automatic);
  EXPECT_FALSE(bias_from_name("sometimes"));
}

}  // namespace
}  // namespace shaker::estimator
