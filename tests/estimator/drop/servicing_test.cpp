// Charge, oil and temperature as changed models, and priors beyond the tested velocities, against
// closed forms and drops of their own.
#include "estimator/drop/servicing.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../fixtures.hpp"
#include "estimator/drop/drop_mixture.hpp"
#include "estimator/drop/falling_damper.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

constexpr std::size_t kStrokeFigure = 0, kLoadFigure = 3;
constexpr double kRoom = 293.15;  // K

config::ModelSpec serviced_oleo(double theta1, double theta2, double theta3) {
  auto spec = oleo();
  spec.effects[0].parameters["theta1"].start = theta1;
  spec.effects[1].parameters["theta2"].start = theta2;
  spec.effects[1].parameters["theta3"].start = theta3;
  spec.effects[1].parameters["theta4"].start = 1.1;
  return spec;
}

std::vector<double> drop_of(const config::ModelSpec& spec) {
  const DropTest test(spec, {3.0, 0.0, 1.5, -1});
  const auto run = test.run(test.model().start(), false);
  EXPECT_TRUE(run.ok()) << (run.ok() ? "" : run.error().what);
  return run->figures;
}

TEST(Servicing, ChangesTheModelAsItsStateSays) {
  const auto base = serviced_oleo(16.0, 1.5, 5.0);
  // 20 K warmer: the charge by 20 / 293.15, the oil thinner by 1.4 %.
  const auto found = drop_of(in_state(base, {1.2, 0.1, 20.0}, kRoom));
  const auto wanted =
      drop_of(serviced_oleo(16.0 * (1.0 - 0.014), 1.5 * 1.2 * (1.0 + 20.0 / kRoom), 5.0 / 0.9));
  for (std::size_t f = 0; f < 11; ++f)
    EXPECT_NEAR(found[f], wanted[f], 1e-7 * std::fabs(wanted[f])) << kDropFigures[f].name;
  EXPECT_THROW(in_state(linear_oscillator(), {}, kRoom), std::invalid_argument);
}

TEST(Servicing, FindsTheWorstStateAndTheSpread) {
  const auto base = serviced_oleo(16.0, 1.5, 5.0);
  ServicingRanges ranges;
  ranges.charge = {0.8, 1.2};
  const auto found =
      servicing_envelope(base, {3.0, 0.0, 1.5, -1}, ranges, {kStrokeFigure, kLoadFigure});
  ASSERT_TRUE(found.ok()) << found.error().what;
  EXPECT_EQ(found->drops, 3 + 128);
  EXPECT_EQ(found->without, 0);
  // Less charge, more stroke; and the load at touch-down holds the charge itself.
  const auto& stroke = found->figures[0];
  EXPECT_NEAR(stroke.greatest, drop_of(serviced_oleo(16.0, 1.2, 5.0))[kStrokeFigure], 1e-7);
  EXPECT_EQ(stroke.greatest_at.charge, 0.8);
  EXPECT_NEAR(stroke.least, drop_of(serviced_oleo(16.0, 1.8, 5.0))[kStrokeFigure], 1e-7);
  const auto& load = found->figures[1];
  EXPECT_NEAR(load.greatest, 16.0 * 9.0 + 1.8, 1e-9);
  EXPECT_NEAR(load.quantiles[1], 16.0 * 9.0 + 1.5, 0.01);
  EXPECT_NEAR(load.quantiles[2] - load.quantiles[0], 0.9 * 0.6, 0.02);
}

TEST(Servicing, CountsStatesWithoutADropAndRefusesRangesOutOfOrder) {
  // Nearly without damping. With little gas left the strut runs into its wall.
  const auto base = serviced_oleo(0.05, 1.5, 5.0);
  ServicingRanges ranges;
  ranges.oil = {0.0, 0.8};
  const auto found = servicing_envelope(base, {3.0, 0.0, 1.5, -1}, ranges, {kStrokeFigure});
  ASSERT_TRUE(found.ok()) << found.error().what;
  EXPECT_GT(found->without, 0);
  EXPECT_LT(found->without, found->drops);
  EXPECT_GT(found->without_at.oil, 0.0);
  ranges.oil = {0.5, 0.1};
  const auto refused = servicing_envelope(base, {3.0, 0.0, 1.5, -1}, ranges, {kStrokeFigure});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, ::testing::HasSubstr("oil"));
}

DamperHypothesis hypothesis_with(double theta1, double probability) {
  DamperHypothesis h;
  h.model = serviced_oleo(theta1, 1.5, 5.0);
  h.probability = probability;
  h.degrees_of_freedom = 1e6;
  return h;
}

TEST(ServicingBand, HoldsEveryHypothesisInEveryCorner) {
  IdentifiedDamper damper;
  damper.hypotheses = {hypothesis_with(16.0, 0.6), hypothesis_with(17.0, 0.4)};
  const DropConditions conditions = {3.0, 0.0, 1.5, -1};
  ServicingRanges ranges;
  ranges.charge = {0.8, 1.2};
  ranges.oil = {-0.1, 0.1};
  auto found = servicing_envelope(damper.hypotheses[0].model, conditions, ranges,
                                  {kStrokeFigure, kLoadFigure});
  ASSERT_TRUE(found.ok()) << found.error().what;
  add_bands(*found, damper, conditions, ranges);
  ASSERT_EQ(found->corners.size(), 4u);
  for (const ServicingBand& corner : found->corners) {
    // The load at touch-down: theta1 V^2 and the charge. The stroke: a drop of its own each.
    const double charge = 1.5 * corner.state.charge, column = 5.0 / (1.0 - corner.state.oil);
    EXPECT_NEAR(corner.figures[1].lower, 16.0 * 9.0 + charge, 1e-6);
    EXPECT_NEAR(corner.figures[1].upper, 17.0 * 9.0 + charge, 1e-6);
    EXPECT_NEAR(corner.figures[0].upper, drop_of(serviced_oleo(16.0, charge, column))[0], 1e-6);
    EXPECT_NEAR(corner.figures[0].lower, drop_of(serviced_oleo(17.0, charge, column))[0], 1e-6);
    EXPECT_EQ(corner.without_drop, 0.0);
  }
  const auto& load = found->figures[1];
  EXPECT_NEAR((*load.greatest_interval)[0], 16.0 * 9.0 + 1.8, 1e-6);
  EXPECT_NEAR((*load.greatest_interval)[1], 17.0 * 9.0 + 1.8, 1e-6);
  EXPECT_NEAR((*load.least_interval)[1], 17.0 * 9.0 + 1.2, 1e-6);
}

TEST(ServicingBand, ScalesWhatIsUncertainOfTheGas) {
  IdentifiedDamper damper;
  damper.hypotheses = {hypothesis_with(16.0, 1.0)};
  damper.hypotheses[0].numbers = {{1, "theta2", false}};
  damper.hypotheses[0].covariance = {0.05 * 0.05};
  const DropConditions conditions = {3.0, 0.0, 1.5, -1};
  ServicingRanges ranges;
  ranges.charge = {0.5, 2.0};
  auto found = servicing_envelope(damper.hypotheses[0].model, conditions, ranges, {kLoadFigure});
  ASSERT_TRUE(found.ok()) << found.error().what;
  add_bands(*found, damper, conditions, ranges);
  // Student's t of 22 degrees of freedom, at 97.5 %.
  for (const ServicingBand& corner : found->corners) {
    const double half = 2.074 * 0.05 * corner.state.charge;
    EXPECT_NEAR(corner.figures[0].value, 144.0 + 1.5 * corner.state.charge, 1e-6);
    EXPECT_NEAR(0.5 * (corner.figures[0].upper - corner.figures[0].lower), half, 0.05 * half);
  }
}

TEST(ServicingBand, SaysWhereACornerHasNoDrop) {
  IdentifiedDamper damper;
  damper.hypotheses = {hypothesis_with(0.05, 1.0)};
  const DropConditions conditions = {3.0, 0.0, 1.5, -1};
  ServicingRanges ranges;
  ranges.oil = {0.0, 0.8};
  auto found = servicing_envelope(damper.hypotheses[0].model, conditions, ranges, {kStrokeFigure});
  ASSERT_TRUE(found.ok()) << found.error().what;
  add_bands(*found, damper, conditions, ranges);
  ASSERT_EQ(found->corners.size(), 2u);
  EXPECT_EQ(found->corners[0].figures.size(), 1u);
  EXPECT_TRUE(found->corners[1].figures.empty());
  EXPECT_EQ(found->corners[1].without_drop, 1.0);
}

IdentifiedDamper surely_known() {
  IdentifiedDamper damper;
  damper.hypotheses.resize(1);
  damper.hypotheses[0].model = serviced_oleo(16.0, 1.5, 5.0);
  damper.hypotheses[0].probability = 1.0;
  damper.hypotheses[0].degrees_of_freedom = 1e6;
  damper.visited = {{0.10, -0.3, 0.0, 0.0}, {0.10, 0.3, 0.0, 0.0}, {0.16, 0.0, 0.0, 0.0}};
  return damper;
}

double half_width(const IdentifiedDamper& damper, const ExtrapolationPriors& priors,
                  std::size_t figure) {
  MixtureOptions options;
  options.priors = priors;
  const auto drop = predict_drop(damper, {3.0, 0.0, 1.5, -1}, options);
  EXPECT_TRUE(drop.ok()) << (drop.ok() ? "" : drop.error().what);
  return 0.5 * (drop->bands[figure].upper - drop->bands[figure].lower);
}

TEST(ExtrapolationPriors, WidenTheBandAsTheyAreStated) {
  const auto damper = surely_known();
  EXPECT_EQ(half_width(damper, {}, kLoadFigure), 0.0);
  // The peak is at touch-down, a decade above the tested 0.3 m/s: 2 x 3 % of the orifice's force.
  const double load = half_width(damper, {0.03, 0.0}, kLoadFigure);
  EXPECT_NEAR(load, 1.96 * 2.0 * 0.03 * 144.0, 0.06 * load);
  EXPECT_NEAR(half_width(damper, {0.06, 0.0}, kLoadFigure), 2.0 * load, 0.1 * load);
  // The index moves the stroke as a model with another index does, and not the load at touch-down.
  auto stiffer = surely_known().hypotheses[0].model, softer = stiffer;
  stiffer.effects[1].parameters["theta4"].start = 1.15;
  softer.effects[1].parameters["theta4"].start = 1.05;
  const double slope = (drop_of(softer)[kStrokeFigure] - drop_of(stiffer)[kStrokeFigure]) / 0.1;
  const double stroke = half_width(damper, {0.0, 0.02}, kStrokeFigure);
  EXPECT_NEAR(stroke, 1.96 * 0.02 * slope, 0.15 * stroke);
  EXPECT_NEAR(half_width(damper, {0.0, 0.02}, kLoadFigure), 0.0, 1e-6);
}

TEST(RunSpread, ActsInTheDropAsInOneMoreRun) {
  auto damper = surely_known();
  damper.spread.gas_pressure = 0.02;
  auto fuller = damper.hypotheses[0].model, emptier = fuller;
  fuller.effects[1].parameters["theta2"].start = 1.5 * 1.02;
  emptier.effects[1].parameters["theta2"].start = 1.5 * 0.98;
  const double change = 0.5 * (drop_of(emptier)[kStrokeFigure] - drop_of(fuller)[kStrokeFigure]);
  const double stroke = half_width(damper, {}, kStrokeFigure);
  EXPECT_NEAR(stroke, 1.96 * change, 0.1 * stroke);
  // A preload of 0.1 m/s^2 counts over the mass: on half of it, it is twice as much.
  damper.spread = {0.1, 0.0, 0.0};
  EXPECT_NEAR(half_width(damper, {}, kLoadFigure), 1.96 * 0.1, 0.02);
  EXPECT_DOUBLE_EQ(with_mass(damper, 0.5).spread.force, 0.2);
}

}  // namespace
}  // namespace shaker::estimator
