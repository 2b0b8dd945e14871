#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using estimator::testing::effect;

// A search meets such fits and evaluates them like the others.
TEST(HarmonicFit, KnowsNoErrorsWhereThereIsNoSolution) {
  const Campaign campaign = testing::recorded({}, {{2.0, 1.5}}, 5);
  Weighed weighed = weigh({steady_cycles(campaign.runs[0]).value()});
  weighed.data[0].driver *= 100.0;  // the gas is compressed beyond its limit
  auto model = estimator::testing::oleo();
  model.effects.push_back(effect("stribeck_friction"));
  const HarmonicFit fit = fit_harmonics(model, weighed.data, {}, nullptr, {});
  ASSERT_FALSE(std::isfinite(fit.chi_squared));
  EXPECT_FALSE(fit.trouble.empty());
  for (const int parameter : fit.free)
    EXPECT_TRUE(std::isnan(fit.standard_error(parameter)));
  EXPECT_FALSE(reduces(fit, "stribeck_friction"));
}

// The orifice and a metering pin have similar effects: chi-squared has a long curved valley. The
// start is far from its end.
struct BentValley {
  BentValley() {
    std::vector<SteadyRun> runs;
    const Campaign campaign =
        testing::recorded({{"metering_k1", 0.5}}, testing::kSixRuns, 6, "oleo", 2e-6);
    for (const Recording& run : campaign.runs)
      runs.push_back(steady_cycles(run).value());
    weighed = weigh(runs);
    model.effects.push_back(effect("metering_pin"));
    start[0] *= 1.5;
    start.insert(start.end(), {0.0, 0.9});
  }
  HarmonicFit fitted(const std::vector<double>& from, const FitOptions& options = {}) const {
    return fit_harmonics(model, weighed.data, from, nullptr, options);
  }

  Weighed weighed;
  config::ModelSpec model = estimator::testing::oleo();
  std::vector<double> start = estimator::testing::kOleoSi;
};

TEST(HarmonicFit, WalksABentValleyInFewSteps) {
  const BentValley valley;
  const HarmonicFit far = valley.fitted(valley.start);
  const HarmonicFit near = valley.fitted(Model(valley.model).start());
  ASSERT_TRUE(near.converged);
  ASSERT_TRUE(far.converged);
  // To the end of the valley, where the grid causes ripples of a tenth.
  EXPECT_LE(far.chi_squared, near.chi_squared + 0.1);
  for (const int k : far.free) {  // a tenth of chi-squared corresponds to this distance
    const auto at = static_cast<std::size_t>(k);
    EXPECT_NEAR(far.theta[at], near.theta[at], 0.32 * near.standard_error(k)) << k;
  }
  EXPECT_LE(far.iterations, 70);
}

// A fit that others have beaten by far is not worth all its steps, unless it still comes nearer.
TEST(HarmonicFit, IsGivenUpWhereItsStepsPromiseNothingOfUse) {
  const BentValley valley;
  const HarmonicFit whole = valley.fitted(valley.start);
  ASSERT_TRUE(whole.converged);
  FitOptions options;
  options.hopeless = 0.5 * whole.chi_squared;  // what others leave
  const HarmonicFit beaten = valley.fitted(valley.start, options);
  EXPECT_TRUE(beaten.given_up);
  EXPECT_FALSE(beaten.converged);
  EXPECT_LT(beaten.iterations, whole.iterations);
  EXPECT_NE(beaten.trouble.find("nor came anywhere near"), std::string::npos) << beaten.trouble;
  options.hopeless = 2.0 * whole.chi_squared;
  const HarmonicFit useful = valley.fitted(valley.start, options);
  EXPECT_FALSE(useful.given_up);
  EXPECT_EQ(useful.theta, whole.theta);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
