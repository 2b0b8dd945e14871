// The honest band of a drop: hypotheses, bounds, instruments, and the unnamed force.
#include "estimator/drop/drop_mixture.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../fixtures.hpp"
#include "estimator/drop/unnamed_force.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

constexpr std::size_t kPeakStroke = 0;

DamperHypothesis oscillator_with(double damping, double error) {
  DamperHypothesis h;
  h.model = linear_oscillator();
  h.model.effects[0].parameters["c"].start = damping;
  h.model.effects[1].parameters["k"].start = 100.0;
  h.numbers = {{0, "c", false}};
  h.covariance = {error * error};
  h.degrees_of_freedom = 1e6;
  h.probability = 1.0;
  return h;
}

// u'' + c u' + 100 u = 0 from u = 0, u' = 1.
double peak_stroke(double damping) {
  const double decay = 0.5 * damping, damped = std::sqrt(100.0 - decay * decay);
  return std::exp(-decay * std::atan2(damped, decay) / damped) / 10.0;
}

DropMixture predicted(const IdentifiedDamper& damper) {
  auto drop = predict_drop(damper, {1.0, 0.0, 1.5, -1});
  EXPECT_TRUE(drop.ok()) << (drop.ok() ? "" : drop.error().what);
  return std::move(*drop);
}

TEST(DropMixture, OfOneHypothesisIsTheImageOfItsParameter) {
  IdentifiedDamper damper;
  damper.hypotheses = {oscillator_with(2.0, 0.1)};
  const auto drop = predicted(damper);
  // Student's t of 22 degrees of freedom, at 97.5 %.
  EXPECT_NEAR(drop.bands[kPeakStroke].lower, peak_stroke(2.0 + 2.074 * 0.1), 1e-4);
  EXPECT_NEAR(drop.bands[kPeakStroke].upper, peak_stroke(2.0 - 2.074 * 0.1), 1e-4);
  EXPECT_NEAR(drop.bands[kPeakStroke].linear_lower, peak_stroke(2.0 + 1.96 * 0.1), 1e-4);
}

TEST(DropMixture, HasABandForEveryCurve) {
  IdentifiedDamper damper;
  damper.hypotheses = {oscillator_with(2.0, 0.05)};
  const auto drop = predicted(damper);
  const auto& band = drop.history;
  const auto& h = drop.run.history;
  ASSERT_GT(band.t.size(), 50u);
  for (std::size_t i = 1; i < band.t.size(); ++i) {
    // Student's t of 22 degrees of freedom, at 97.5 %, by the closed form's derivative over c.
    const auto motion = [&](double c, bool speed) {
      const double decay = 0.5 * c, damped = std::sqrt(100.0 - decay * decay);
      const double wave = std::sin(damped * band.t[i]) / damped;
      const double fall = std::exp(-decay * band.t[i]);
      return speed ? fall * (std::cos(damped * band.t[i]) - decay * wave) : fall * wave;
    };
    for (const bool speed : {false, true}) {
      const double slope = (motion(2.01, speed) - motion(1.99, speed)) / 0.02;
      const double half = 2.074 * 0.05 * std::fabs(slope);
      const double width = speed ? band.speed_upper[i] - band.speed_lower[i]
                                 : band.stroke_upper[i] - band.stroke_lower[i];
      EXPECT_NEAR(0.5 * width, half, 0.35 * half + 1e-6) << band.t[i];
    }
  }
  EXPECT_NEAR(0.5 * (band.speed_lower[0] + band.speed_upper[0]), h.speed[0], 1e-9);
}

TEST(DropMixture, HoldsEveryHypothesis) {
  IdentifiedDamper damper;
  damper.hypotheses = {oscillator_with(2.0, 0.01), oscillator_with(3.0, 0.01)};
  damper.hypotheses[0].probability = 0.7;
  damper.hypotheses[1].probability = 0.3;
  const auto drop = predicted(damper);
  EXPECT_NEAR(drop.bands[kPeakStroke].value, peak_stroke(2.0), 1e-7);
  EXPECT_NEAR(drop.bands[kPeakStroke].lower, peak_stroke(3.0), 1e-3);
  EXPECT_NEAR(drop.bands[kPeakStroke].upper, peak_stroke(2.0), 1e-3);
  EXPECT_LT(drop.bands[kPeakStroke].linear_upper - drop.bands[kPeakStroke].linear_lower,
            0.1 * (drop.bands[kPeakStroke].upper - drop.bands[kPeakStroke].lower));
}

TEST(DropMixture, GivesTheMedianWhereTheFirstHypothesisIsOutsideOfTheInterval) {
  IdentifiedDamper damper;
  damper.hypotheses = {oscillator_with(6.0, 0.01), oscillator_with(2.0, 0.01),
                       oscillator_with(3.0, 0.01)};
  damper.hypotheses[0].probability = 0.01;
  damper.hypotheses[1].probability = 0.7;
  damper.hypotheses[2].probability = 0.29;
  const auto drop = predicted(damper);
  const MixtureBand& band = drop.bands[kPeakStroke];
  EXPECT_TRUE(band.median);
  EXPECT_NEAR(band.value, peak_stroke(2.0), 2e-3 * peak_stroke(2.0));
  EXPECT_EQ(drop.warnings.size(), 1u);
  for (const MixtureBand& each : drop.bands) {
    if (std::isfinite(each.value)) {
      EXPECT_EQ(std::clamp(each.value, each.lower, each.upper), each.value);
    }
  }
}

TEST(DropMixture, HoldsAnEstimateAtItsBound) {
  IdentifiedDamper damper;
  damper.hypotheses = {oscillator_with(2.0, 0.1)};
  damper.hypotheses[0].model.effects[0].parameters["c"].lower = 2.0;
  damper.hypotheses[0].numbers.push_back({1, "k", false});
  damper.hypotheses[0].covariance = {0.01, 0.0, 0.0, 0.01};
  const auto drop = predicted(damper);
  EXPECT_GE(drop.bands[kPeakStroke].upper, peak_stroke(2.0));
  EXPECT_LT(drop.bands[kPeakStroke].lower, peak_stroke(2.15));
  EXPECT_GT(drop.bands[kPeakStroke].lower, peak_stroke(2.0 + 4.0 * 0.1));
}

TEST(DropMixture, LeavesTheInstrumentsOnTheShaker) {
  IdentifiedDamper damper;
  damper.hypotheses = {oscillator_with(2.0, 0.1)};
  const auto alone = predicted(damper);
  auto& h = damper.hypotheses[0];
  h.model.effects.insert(h.model.effects.begin(), effect("exciter_delay"));
  h.model.effects.push_back(effect("sensor_gain"));
  h.numbers = {{3, "G", false}, {1, "c", false}};
  h.covariance = {1.0, 0.05, 0.05, 0.01};
  const auto drop = predicted(damper);
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    if (!std::isfinite(alone.bands[f].value)) continue;
    EXPECT_DOUBLE_EQ(drop.bands[f].value, alone.bands[f].value);
    EXPECT_DOUBLE_EQ(drop.bands[f].upper, alone.bands[f].upper);
  }
}

IdentifiedDamper visited_ring() {
  IdentifiedDamper damper;
  damper.hypotheses = {oscillator_with(2.0, 0.001)};
  for (int i = 0; i < 40; ++i)
    damper.visited.push_back({0.02 * std::cos(0.157 * i), 0.2 * std::sin(0.157 * i), 0.0, 0.0});
  damper.unnamed_probability = 1.0;
  damper.unnamed_force = 0.01;
  return damper;
}

double deviation(const ForceAlongPath& force, std::size_t at) {
  double squares = 0.0;
  for (const auto& mode : force.modes)
    squares += mode[at] * mode[at];
  return std::sqrt(squares);
}

TEST(UnnamedForce, WidensOutsideOfWhatWasVisited) {
  const auto force = unnamed_force_along(visited_ring().visited, {0.01}, {0.02, 0.02, 0.1, 0.0},
                                         {0.0, 0.4, 0.4, 2.0}, nullptr, 4, 1e-9);
  EXPECT_LT(deviation(force, 0), 0.01);
  EXPECT_GT(deviation(force, 1), 0.02);
  EXPECT_GT(deviation(force, 2), deviation(force, 1));
  EXPECT_GT(deviation(force, 3), 10.0 * deviation(force, 1));
}

TEST(UnnamedForce, FollowsWhatTheCampaignLeft) {
  auto damper = visited_ring();
  for (VisitedCell& cell : damper.visited) {
    cell.force = 0.5;
    cell.standard_error = 0.01;
  }
  const auto force = unnamed_force_along(damper.visited, {0.01}, {0.02, 0.0}, {0.0, 0.2});
  EXPECT_NEAR(force.mean[0], 0.5, 0.05);
  EXPECT_NEAR(force.mean[1], 0.5, 0.05);
}

// A force of 10 m/s^2 a metre that names have taken where the campaign was: they may be wrong beyond
// by what it changes there, and as little as before where it is known.
TEST(UnnamedForce, GoesOnBeyondAsTheWholeGapMayWhateverNamesTookOfIt) {
  auto cells = visited_ring().visited;
  for (VisitedCell& cell : cells)
    cell.force = 10.0 * cell.stroke;
  const double taken = root_mean_square(cells);
  const std::vector<double> stroke = {0.0, 0.04, 0.06}, still = {0.0, 0.0, 0.0};
  const auto ring = visited_ring().visited;
  const auto alone = unnamed_force_along(ring, {0.01}, stroke, still, nullptr, 4, 1e-9);
  const auto named = unnamed_force_along(ring, {0.01, taken}, stroke, still, nullptr, 4, 1e-9);
  EXPECT_NEAR(deviation(named, 0), deviation(alone, 0), 0.05 * deviation(alone, 0));
  for (const std::size_t beyond : {std::size_t{1}, std::size_t{2}}) {
    const double change = 10.0 * (stroke[beyond] - 0.02);
    EXPECT_LT(deviation(alone, beyond), 0.2 * change);
    EXPECT_GT(deviation(named, beyond), 0.5 * change);
    EXPECT_LT(deviation(named, beyond), 2.0 * change);
  }
}

TEST(UnnamedForce, MakesTheBandWider) {
  auto damper = visited_ring();
  const auto wide = predicted(damper);
  damper.unnamed_probability = 0.0;
  const auto narrow = predicted(damper);
  EXPECT_GT(wide.bands[kPeakStroke].upper - wide.bands[kPeakStroke].lower,
            3.0 * (narrow.bands[kPeakStroke].upper - narrow.bands[kPeakStroke].lower));
}

// Forces of a hundred times the spring's, of which nothing is known.
TEST(UnnamedForce, LetsNoFigureBeWhatItCannotBe) {
  auto damper = visited_ring();
  damper.unnamed_force = 200.0;
  const auto drop = predicted(damper);
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    if (!std::isfinite(drop.bands[f].value)) continue;
    EXPECT_GE(drop.bands[f].lower, kDropFigures[f].lower) << kDropFigures[f].name;
    EXPECT_LE(drop.bands[f].upper, kDropFigures[f].upper) << kDropFigures[f].name;
  }
  const double spring = 100.0 * peak_stroke(2.0);
  EXPECT_GT(drop.bands[figure_called("peak_load")].upper, 100.0 * spring);
}

// The first one leaves nothing that is worth a force; a rival leaves 0.5 m/s^2 everywhere, with its
// force, and so falls less far.
TEST(UnnamedForce, ActsBesideEachHypothesisThatLeavesOne) {
  auto damper = visited_ring();
  damper.hypotheses.push_back(damper.hypotheses.front());
  for (DamperHypothesis& h : damper.hypotheses)
    h.probability = 0.5;
  damper.unnamed_force = 1e-6;
  const auto alike = predicted(damper);
  damper.hypotheses[1].left = damper.visited;
  for (VisitedCell& cell : damper.hypotheses[1].left) {
    cell.force = 0.5;
    cell.standard_error = 0.01;
  }
  const auto apart = predicted(damper);
  EXPECT_EQ(apart.bands[kPeakStroke].value, alike.bands[kPeakStroke].value);
  EXPECT_LT(apart.bands[kPeakStroke].lower, alike.bands[kPeakStroke].lower - 1e-4);
}

// u'' + c u' + k u: a force of the velocity alone has been taken by the damping, as far as the
// campaign tells. With each force the damping is what remains of c, so that both together stay: the
// force may be large, and the sum in the cells may not.
TEST(UnnamedForce, LeavesTheSumWithTheParametersThatWereBentByIt) {
  auto ring = visited_ring();
  const auto& one = ring.hypotheses.front();
  for (VisitedCell& cell : ring.visited)
    cell.force = 0.3 * std::sin(300.0 * cell.stroke);
  std::vector<double> stroke, velocity;
  for (const VisitedCell& cell : ring.visited) {
    stroke.push_back(cell.stroke);
    velocity.push_back(cell.velocity);
  }
  stroke.push_back(0.0);
  velocity.push_back(1.0);
  const auto rough = unnamed_force_along(ring.visited, {0.01}, stroke, velocity, nullptr, 60, 1e-9);
  const auto smooth = unnamed_force_along(ring.visited, {0.01}, stroke, velocity, &one, 60, 1e-9);
  ASSERT_EQ(smooth.shifts.size(), smooth.modes.size());
  double shift = 0.0, beyond = 0.0;
  for (std::size_t i = 0; i < stroke.size(); ++i) {
    double squares = 0.0, force = 0.0;
    for (std::size_t m = 0; m < smooth.modes.size(); ++m) {
      const double damping = smooth.shifts[m][0];
      squares += std::pow(smooth.modes[m][i] + damping * velocity[i], 2);
      force += std::pow(smooth.modes[m][i], 2);
    }
    shift = std::max(shift, std::sqrt(force));
    if (i + 1 < stroke.size())
      EXPECT_LT(std::sqrt(squares), 0.02) << i;
    else
      beyond = std::sqrt(squares);
  }
  EXPECT_GT(shift, 0.04);
  EXPECT_GT(beyond, deviation(rough, stroke.size() - 1));
  EXPECT_TRUE(rough.shifts.empty());
}

// The damping goes with the cube of the velocity. What c v leaves of it up to 0.2 m/s tells the law well
// enough for twice that speed, and not so well that the law would be sure.
TEST(UnnamedForce, GoesOnWithAnotherLawOfTheVelocity) {
  auto damper = visited_ring();
  const double cube = 50.0, taken = 0.65 * cube * 0.2 * 0.2;
  const auto left = [&](double v) { return cube * v * v * v - taken * v; };
  std::vector<VisitedCell> cells;
  for (const double size : {0.4, 0.7, 1.0}) {
    for (const VisitedCell& cell : damper.visited) {
      const double v = size * cell.velocity;
      cells.push_back({size * cell.stroke, v, left(v), 0.005});
    }
  }
  const auto force = unnamed_force_along(cells, {0.02}, {0.0, 0.0}, {0.2, 0.4},
                                         &damper.hypotheses.front(), 10, 1e-9);
  const std::vector<double> velocity = {0.2, 0.4};
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const double mean = force.mean[i] + force.mean_shift[0] * velocity[i];
    double squares = 0.0;
    for (std::size_t m = 0; m < force.modes.size(); ++m)
      squares += std::pow(force.modes[m][i] + force.shifts[m][0] * velocity[i], 2);
    const double deviation = std::sqrt(squares);
    EXPECT_LT(std::fabs(mean - left(velocity[i])), 2.0 * deviation) << mean << ", " << deviation;
    EXPECT_LT(deviation, 0.5 * std::fabs(left(velocity[i])));
  }
}

// An orifice that changes in waves over the stroke. Where the campaign has seen it, it is the same at
// twice the tested velocity.
TEST(UnnamedForce, GoesOnWithAnOrificeThatChangesOverTheStroke) {
  const auto acts = [](double u, double v) {
    return 2.0 * std::sin(2.0 * M_PI * u / 0.016) * v * std::fabs(v) / 0.04;
  };
  std::vector<VisitedCell> cells;
  for (int i = 0; i < 12; ++i) {
    for (int k = 0; k < 12; ++k) {
      const double u = -0.02 + 0.04 * i / 11.0, v = -0.2 + 0.4 * k / 11.0;
      cells.push_back({u, v, acts(u, v), 0.02});
    }
  }
  const std::vector<double> stroke = {0.004, 0.004}, velocity = {0.3, 0.4};
  const auto force = unnamed_force_along(cells, {0.03}, stroke, velocity, nullptr, 4, 1e-9);
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const double truth = acts(stroke[i], velocity[i]);
    EXPECT_LT(std::fabs(force.mean[i] - truth), 2.0 * deviation(force, i)) << force.mean[i];
    EXPECT_LT(deviation(force, i), 0.25 * truth);
  }
}

TEST(VisitedRegion, IsTheHullOfItsCells) {
  const VisitedRegion region(visited_ring().visited);
  EXPECT_TRUE(region.holds(0.0, 0.0));
  EXPECT_TRUE(region.holds(0.01, 0.1));
  EXPECT_FALSE(region.holds(0.019, 0.19));
  EXPECT_FALSE(region.holds(0.0, 0.3));
  EXPECT_FALSE(VisitedRegion({}).holds(0.0, 0.0));
}

}  // namespace
}  // namespace shaker::estimator
