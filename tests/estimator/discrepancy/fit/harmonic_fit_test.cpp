#include "estimator/discrepancy/fit/harmonic_fit.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "estimator/discrepancy/cycles/steady_cycles.hpp"
#include "estimator/discrepancy/name/nesting.hpp"
#include "estimator/discrepancy/weigh/weighing.hpp"
#include "tests/estimator/discrepancy/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using estimator::testing::effect;

// A search meets such fits among others, and asks them the same questions.
TEST(HarmonicFit, KnowsNoErrorsWhereThereIsNoSolution) {
  const Campaign campaign = testing::recorded({}, {{2.0, 1.5}}, 5);
  Weighed weighed = weigh({steady_cycles(campaign.runs[0]).value()});
  weighed.data[0].driver *= 10.0;  // the gas is compressed beyond its end
  auto model = estimator::testing::oleo();
  model.effects.push_back(effect("stribeck_friction"));
  const HarmonicFit fit = fit_harmonics(model, weighed.data, {}, nullptr, {});
  ASSERT_FALSE(std::isfinite(fit.chi_squared));
  EXPECT_FALSE(fit.trouble.empty());
  for (const int parameter : fit.free)
    EXPECT_TRUE(std::isnan(fit.standard_error(parameter)));
  EXPECT_FALSE(reduces(fit, "stribeck_friction"));
}

}  // namespace
}  // namespace shaker::estimator::discrepancy
