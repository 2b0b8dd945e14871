// Another mass and a tyre under the damper, against closed forms and a model that is written out; the
// shares of the effects; and the conditions by rule with a descent that is known.
#include "estimator/drop/falling_damper.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../fixtures.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/drop/drop_mixture.hpp"
#include "estimator/drop/drop_rule.hpp"
#include "estimator/solve/time/excitation.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

double figure_of(const DropRun& run, const std::string& name) {
  return run.figures[figure_called(name)];
}

DropRun dropped(const config::ModelSpec& spec, const std::vector<double>& theta, double speed,
                double lift = 0.0) {
  const DropTest test(spec, {speed, lift, 1.5, -1});
  auto run = test.run(theta, false);
  EXPECT_TRUE(run.ok()) << (run.ok() ? "" : run.error().what);
  return std::move(*run);
}

// m u'' + c u' + k u = 0 from u = 0, u' = 1; c and k over the mass on the shaker.
double peak_of_oscillator(double c, double k, double m) {
  const double decay = 0.5 * c / m, damped = std::sqrt(k / m - decay * decay);
  const double t = std::atan2(damped, decay) / damped;
  return std::exp(-decay * t) * std::sin(damped * t) / damped;
}

TEST(FallingDamper, CarriesAnotherMass) {
  for (const double ratio : {0.5, 1.0, 2.5}) {
    const auto run = dropped(with_mass(linear_oscillator(), ratio), {3.0, 150.0}, 1.0);
    EXPECT_NEAR(figure_of(run, "peak_stroke"), peak_of_oscillator(3.0, 150.0, ratio), 1e-7);
  }
  // A heavy mass on the whole damper is a light one on a damper of which everything is larger.
  const auto heavy = dropped(with_mass(oleo(), 2.0), {16.0, 1.5, 5.3, 1.1}, 3.0);
  const auto same = dropped(oleo(), {8.0, 0.75, 5.3, 1.1}, 3.0);
  for (const char* name : {"peak_stroke", "peak_load", "efficiency", "rebound_stroke"})
    EXPECT_NEAR(figure_of(heavy, name) / figure_of(same, name), 1.0, 1e-7) << name;
}

TEST(FallingDamper, KeepsTheMassesBelowIt) {
  // Twice the mass above: the unsprung share, spring and damping of the tyre halve.
  const auto heavy =
      dropped(with_mass(oleo_on_tyre(0.1), 2.0), {16.0, 1.5, 5.3, 1.1, 2000.0, 6.0}, 3.0, 0.5);
  const auto same = dropped(oleo_on_tyre(0.05), {8.0, 0.75, 5.3, 1.1, 1000.0, 3.0}, 3.0, 0.5);
  for (const char* name : {"peak_stroke", "travel", "tyre_deflection", "peak_ground_load"})
    EXPECT_NEAR(figure_of(heavy, name) / figure_of(same, name), 1.0, 1e-6) << name;
}

TEST(FallingDamper, StandsOnATyreThatIsGivenInNewton) {
  auto spec = oleo();
  spec.effects[0].parameters["theta1"].start = 16.0;
  const double sprung = 400.0;
  const DropTest test(on_tyre(spec, {800e3, 2400.0, 40.0}, sprung), {3.0, 0.0, 1.5, -1});
  const auto run = test.run(test.model().start(), false);
  ASSERT_TRUE(run.ok()) << run.error().what;
  const auto written = dropped(oleo_on_tyre(0.1), {16.0, 1.5, 5.0, 1.1, 2000.0, 6.0}, 3.0);
  for (std::size_t f = 0; f < kDropFigureCount; ++f)
    EXPECT_NEAR(run->figures[f] / written.figures[f], 1.0, 1e-7) << kDropFigures[f].name;
  EXPECT_GT(figure_of(*run, "travel"), figure_of(*run, "peak_stroke"));
  EXPECT_THROW(on_tyre(oleo_on_tyre(0.1), {1e5, 0.0, 40.0}, sprung), std::invalid_argument);
  EXPECT_THROW(on_tyre(spec, {0.0, 0.0, 40.0}, sprung), std::invalid_argument);
}

TEST(FallingDamper, PushesTheUnsprungMassTheOtherWay) {
  // A constant force of the damper, as a push and as a line of the model.
  const std::vector<double> theta = {16.0, 1.5, 5.3, 1.1, 2000.0, 6.0};
  const DropConditions conditions{3.0, 0.0, 1.5, -1};
  const auto pushed =
      DropTest(oleo_on_tyre(0.1), conditions).run(theta, false, Excitation::constant(2.0));
  auto spec = oleo_on_tyre(0.1);
  auto line = effect("gravity");
  line.constants["g"] = 2.0;
  line.sees = {1.0, 0.0};
  line.acts = {1.0, -1.0};
  spec.effects.push_back(line);
  const auto written = DropTest(spec, conditions).run(theta, false);
  ASSERT_TRUE(pushed.ok() && written.ok());
  for (const char* name : {"peak_stroke", "travel", "tyre_deflection"})
    EXPECT_NEAR(figure_of(*pushed, name) / figure_of(*written, name), 1.0, 1e-7) << name;
  EXPECT_GT(figure_of(*pushed, "peak_stroke"),
            1.001 * figure_of(dropped(oleo_on_tyre(0.1), theta, 3.0), "peak_stroke"));
}

TEST(FallingDamper, HasNoTyreFiguresWithoutATyre) {
  const auto run = dropped(oleo(), kOleoSi, 3.0);
  EXPECT_EQ(figure_of(run, "travel"), figure_of(run, "peak_stroke"));
  EXPECT_TRUE(std::isnan(figure_of(run, "tyre_deflection")));
  EXPECT_TRUE(std::isnan(figure_of(run, "peak_ground_load")));
}

TEST(DropShares, AreTheFormulasOfTheEffects) {
  const std::vector<double> theta = {16.0, 1.5, 5.3, 1.1};
  const DropTest test(oleo(), {3.0, 0.4, 1.5, -1});
  const auto run = test.run(theta, false);
  const auto shares = test.shares(theta);
  ASSERT_TRUE(run.ok() && shares.ok());
  ASSERT_EQ(shares->effects.size(), 2u);
  const auto& h = run->history;
  for (std::size_t i = 0; i < h.t.size(); i += 100) {
    EXPECT_NEAR(shares->effects[0].load[i], 16.0 * std::fabs(h.speed[i]) * h.speed[i], 1e-9);
    EXPECT_NEAR(shares->effects[1].load[i], 1.5 * std::pow(1.0 - 5.3 * h.stroke[i], -1.1), 1e-9);
  }
  // At touch-down, where the load is largest.
  EXPECT_NEAR(shares->effects[0].of_peak_load, 144.0 / 145.5, 1e-9);
  EXPECT_NEAR(shares->effects[0].of_energy + shares->effects[1].of_energy, 1.0, 1e-12);
}

TEST(DropShares, CloseTheBalanceOfEnergy) {
  const std::vector<double> theta = {16.0, 1.5, 5.3, 1.1};
  for (const double lift : {0.0, 0.667, 1.0}) {
    for (const double ratio : {0.7, 1.0, 1.6}) {
      const DropTest test(with_mass(oleo(), ratio), {3.5, lift, 1.5, -1});
      const auto shares = test.shares(theta);
      ASSERT_TRUE(shares.ok()) << shares.error().what;
      EXPECT_LT(std::fabs(shares->energy_residual), 1e-6);
    }
    const DropTest gear(oleo_on_tyre(0.1), {3.5, lift, 1.5, -1});
    const auto shares = gear.shares({16.0, 1.5, 5.3, 1.1, 2000.0, 6.0});
    ASSERT_TRUE(shares.ok()) << shares.error().what;
    EXPECT_LT(std::fabs(shares->energy_residual), 1e-6);
  }
}

TEST(DropMixture, GivesTheProbabilityOfALimit) {
  DamperHypothesis h;
  h.model = linear_oscillator();
  h.model.effects[0].parameters["c"].start = 2.0;
  h.model.effects[1].parameters["k"].start = 100.0;
  h.numbers = {{0, "c", false}};
  h.covariance = {0.01};
  h.degrees_of_freedom = 1e6;
  h.probability = 1.0;
  IdentifiedDamper damper;
  damper.hypotheses = {h};
  const auto drop = predict_drop(damper, {1.0, 0.0, 1.5, -1});
  ASSERT_TRUE(drop.ok()) << drop.error().what;
  const std::size_t stroke = figure_called("peak_stroke");
  // More damping is less stroke. Student's t of ten degrees of freedom: 1.812 is 95 %, 0 is half.
  EXPECT_NEAR(drop->probability_within(stroke, peak_of_oscillator(2.0, 100.0, 1.0)), 0.5, 0.02);
  EXPECT_NEAR(drop->probability_within(stroke, peak_of_oscillator(2.0 - 0.1812, 100.0, 1.0)), 0.95,
              0.01);
  EXPECT_EQ(drop->probability_within(stroke, 0.0), 0.0);
  EXPECT_TRUE(std::isnan(drop->probability_within(figure_called("tyre_deflection"), 1.0)));
}

TEST(FallingDamper, ScalesTheForceThatNobodyNames) {
  IdentifiedDamper damper;
  damper.hypotheses.resize(1);
  damper.hypotheses[0].model = oleo();
  damper.visited = {{0.01, 0.2, 4.0, 1.0}};
  damper.hypotheses[0].left = {{0.01, 0.2, 3.0, 0.8}};
  damper.unnamed_force = 0.6;
  const auto falling = with_mass(damper, 2.0);
  EXPECT_DOUBLE_EQ(falling.visited[0].force, 2.0);
  EXPECT_DOUBLE_EQ(falling.visited[0].standard_error, 0.5);
  EXPECT_DOUBLE_EQ(falling.hypotheses[0].left[0].force, 1.5);
  EXPECT_DOUBLE_EQ(falling.hypotheses[0].left[0].standard_error, 0.4);
  EXPECT_DOUBLE_EQ(falling.unnamed_force, 0.3);
  EXPECT_DOUBLE_EQ(falling.visited[0].stroke, 0.01);
}

// A gear whose descent grows with the weight, so that d = W_e / stiffness.
DescentOfDrop soft_gear(double stiffness) {
  return
      [stiffness](double weight, double, double) -> Result<double> { return weight / stiffness; };
}

TEST(DropRule, IteratesTheEffectiveWeight) {
  RuleData data;
  data.rule = "23.725";
  data.weight = 12e3;
  data.lift = 0.5;
  data.wing_loading = 18.0 * 47.88025898;  // lb/ft^2
  const auto drop = drop_by_rule(data, soft_gear(40e3));
  ASSERT_TRUE(drop.ok()) << drop.error().what;
  EXPECT_NEAR(drop->height, 3.6 * std::sqrt(18.0) * 0.0254, 1e-9);
  const double d = drop->descent, h = drop->height;
  EXPECT_NEAR(drop->effective_weight, 12e3 * (h + 0.5 * d) / (h + d), 1e-6);
  EXPECT_NEAR(d, drop->effective_weight / 40e3, 1e-9);
  EXPECT_EQ(drop->acting_lift(), 0.0);
  EXPECT_NEAR(drop->load_factor(9.80665), 2.0 * drop->effective_weight / 12e3 + 0.5, 1e-12);
}

TEST(DropRule, KeepsTheHeightsWithinTheirEnds) {
  const auto height = [](const char* rule, const char* condition, double loading, double speed) {
    RuleData data;
    data.rule = rule;
    data.condition = condition;
    data.weight = 1e4;
    if (loading > 0.0) data.wing_loading = loading * 47.88025898;
    if (speed > 0.0) data.sink_speed = speed;
    const auto drop = drop_by_rule(data, soft_gear(1e5));
    EXPECT_TRUE(drop.ok()) << (drop.ok() ? "" : drop.error().what);
    return drop->height / 0.0254;
  };
  EXPECT_NEAR(height("23.725", "design", 2.0, 0.0), 9.2, 1e-9);
  EXPECT_NEAR(height("23.725", "design", 60.0, 0.0), 18.7, 1e-9);
  EXPECT_NEAR(height("23.725", "reserve", 60.0, 0.0), 1.44 * 18.7, 1e-9);
  EXPECT_NEAR(height("27.725", "design", 0.0, 0.0), 13.0, 1e-9);
  EXPECT_NEAR(height("27.725", "design", 0.0, 0.5), 8.0, 1e-9);
  EXPECT_NEAR(height("27.725", "reserve", 0.0, 5.0), 19.5, 1e-9);
  EXPECT_NEAR(height("29.725", "design", 0.0, 0.0), 8.0, 1e-9);
  EXPECT_NEAR(height("25.723", "design", 0.0, 0.0), 120.0 * 120.0 / (2.0 * 386.0886), 1e-4);
}

TEST(DropRule, RefusesWhatIsOutsideOfItsRange) {
  RuleData good;
  good.rule = "23.725";
  good.weight = 1e4;
  good.wing_loading = 900.0;
  const auto why = [](const RuleData& data) {
    const auto drop = drop_by_rule(data, soft_gear(1e5));
    return drop.ok() ? std::string("accepted") : drop.error().what;
  };
  EXPECT_EQ(why(good), "accepted");
  auto bad = good;
  bad.lift = 0.8;
  EXPECT_THAT(why(bad), ::testing::HasSubstr("23.725(b) allows a lift of 0 to 0.667"));
  bad = good;
  bad.wing_loading.reset();
  EXPECT_THAT(why(bad), ::testing::HasSubstr("--wing-loading"));
  bad = good;
  bad.condition = "take-off";
  EXPECT_THAT(why(bad), ::testing::HasSubstr("has no condition \"take-off\""));
  bad = good;
  bad.rule = "23.473";
  EXPECT_THAT(why(bad), ::testing::HasSubstr("there is no rule"));
  bad = good;
  bad.gravity = 0.0;
  EXPECT_THAT(why(bad), ::testing::HasSubstr("no gravity"));
}

}  // namespace
}  // namespace shaker::estimator
