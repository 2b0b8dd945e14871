#include "estimator/diagnosis/fit/internal/smoothing.hpp"

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

struct Fitted {
  std::vector<RunDatum> data;
  HarmonicFit fit;
};

// The oleo with dry friction, with the smallest smoothing width that the ordinary grid allows.
Fitted with_friction(const std::map<std::string, double>& truth) {
  const Campaign campaign =
      testing::recorded(truth, {{0.8, 2.0}, {0.8, 3.0}, {1.2, 2.0}, {1.2, 3.2}}, 3);
  std::vector<SteadyRun> runs;
  for (const Recording& run : campaign.runs)
    runs.push_back(steady_cycles(run).value());
  auto model = estimator::testing::oleo();
  model.effects.push_back(estimator::testing::effect("coulomb_friction"));
  FitOptions options;
  options.sharp = true;
  Fitted fitted{weigh(runs).data, {}};
  fitted.fit = fit_harmonics(model, fitted.data, {}, nullptr, options);
  return fitted;
}

double of_coulomb(const HarmonicFit& fit) {
  return fit.theta.back();
}

// The damper sticks twice in a cycle. The error from the smoothing width is many times the
// noise, and the slopes on a coarse grid do not give the limit of width zero.
TEST(Corners, OfADamperThatSticksAreTakenDownToNoise) {
  const auto [data, fit] = with_friction({{"coulomb_friction", 0.4}});
  ASSERT_TRUE(fit.converged);
  EXPECT_GT(fit.chi_squared, 100.0 * fit.observations);
  const auto sharp = to_zero_width(fit, data, {});
  ASSERT_TRUE(sharp);
  EXPECT_LT(sharp->fit->chi_squared, 2.0 * fit.observations);
  const int last = sharp->fit->free.back();
  EXPECT_NEAR(of_coulomb(*sharp->fit), 0.4, 5.0 * sharp->fit->standard_error(last));
  EXPECT_GT(std::fabs(of_coulomb(fit) - 0.4), 5.0 * sharp->fit->standard_error(last));
}

// A finer grid allows a smaller smoothing width; the fit stops there when this is enough.
TEST(Corners, AreAsSharpAsTheFinestGridWhereThatWillDo) {
  const auto [data, fit] = with_friction({{"coulomb_friction", 0.4}});
  const auto on_grids = to_zero_width(fit, data, {}, {.on_grids = true});
  ASSERT_TRUE(on_grids);
  EXPECT_EQ(on_grids->fit->predictions.front().points(), 2 * fit.predictions.front().points());
  EXPECT_LT(on_grids->fit->chi_squared, 0.5 * fit.chi_squared);
  EXPECT_EQ(on_grids->data->front().to_limit, nullptr);
}

// The effect of the limit is known from a first fit; other errors move the parameters only a
// little.
TEST(Corners, OfNoWidthAreCarriedToOtherErrors) {
  const auto [data, fit] = with_friction({{"coulomb_friction", 0.4}});
  const auto known = to_zero_width(fit, data, {});
  ASSERT_TRUE(known);
  std::vector<RunDatum> other = data;
  for (std::size_t r = 0; r < other.size(); ++r)
    set_covariance(other[r], (r == 0 ? 0.7 : 1.3) * covariance_of(data[r]));
  const auto carried_over = carried(*known->fit, *known->data, other, {});
  ASSERT_TRUE(carried_over);
  const auto anew = to_zero_width(fit, other, {});
  ASSERT_TRUE(anew);
  EXPECT_NE(carried_over->fit->theta, known->fit->theta);
  EXPECT_NEAR(carried_over->fit->chi_squared, anew->fit->chi_squared,
              0.02 * anew->fit->observations);
  for (const int k : anew->fit->free) {
    EXPECT_NEAR(carried_over->fit->theta[static_cast<std::size_t>(k)],
                anew->fit->theta[static_cast<std::size_t>(k)], 0.3 * anew->fit->standard_error(k));
  }
}

TEST(Corners, OfNoWidthAreNotCarriedFarNorFromWhatHasNone) {
  const auto [data, fit] = with_friction({{"coulomb_friction", 0.4}});
  const auto known = to_zero_width(fit, data, {});
  ASSERT_TRUE(known);
  std::vector<RunDatum> moved = data;
  for (RunDatum& datum : moved)
    datum.response *= 1.01;
  EXPECT_FALSE(carried(*known->fit, *known->data, moved, {}));
  EXPECT_FALSE(carried(fit, data, data, {}));
}

TEST(Corners, AreLeftWhereNoSharpnessLeadsToNoise) {
  const auto [data, fit] = with_friction({{"viscous_damping", 1.5}});
  ASSERT_TRUE(fit.converged);
  EXPECT_GT(fit.chi_squared, 100.0 * fit.observations);
  EXPECT_FALSE(to_zero_width(fit, data, {}));
}

// A fit that was stopped before it had a motion has nothing to compare a finer one with.
TEST(Corners, OfAFitWithoutAMotionAreLeft) {
  auto model = estimator::testing::linear_oscillator();
  model.effects.push_back(estimator::testing::effect("presliding_friction"));
  const auto force = [](double u, double v) { return 60.0 * u + 0.4 * v; };
  auto runs = transient_runs({testing::decay_of(force, {})}, model);
  ASSERT_TRUE(runs) << runs.error().what;
  runs->data.front().budget = std::make_shared<EvaluationBudget>();
  FitOptions options;
  options.fit_budget = 1.0;
  const HarmonicFit stopped = fit_transient(model, *runs, options);
  ASSERT_TRUE(stopped.stopped);
  EXPECT_FALSE(to_zero_width(stopped, runs->data, {}));
}

TEST(Corners, OfARivalMustLeadBelowWhatTheBestLeaves) {
  const auto [data, fit] = with_friction({{"coulomb_friction", 0.02}});
  EXPECT_LT(fit.chi_squared, 4.0 * fit.observations);
  EXPECT_TRUE(to_zero_width(fit, data, {}, {.touched = 0.0, .hopeless = 2.0 * fit.chi_squared}));
  EXPECT_FALSE(to_zero_width(fit, data, {}, {.touched = 0.0, .hopeless = 0.5 * fit.chi_squared}));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
