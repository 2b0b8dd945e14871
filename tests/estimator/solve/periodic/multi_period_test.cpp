// Compares subharmonic responses with time integration by Odeint.
#include "estimator/solve/periodic/multi_period.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <boost/numeric/odeint.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/solve/periodic/continuation.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/estimator/solve/periodic/duffing_in_time.hpp"

namespace shaker::estimator {
namespace {

using testing::DuffingInTime;
using testing::State;

// A spring under load, x'' + c x' + x + x^3 = 0.8 + A cos, is asymmetric; its period doubles
// when it is excited at twice its natural frequency.
config::ModelSpec loaded_duffing() {
  config::ModelSpec spec = testing::duffing();
  spec.effects.push_back(testing::effect("gravity"));
  spec.gravity = 0.8;
  return spec;
}
const std::vector<double> kLoaded = {0.08, 1.0, 1.0};
constexpr double kOmega = 3.1;

class Doubling : public ::testing::Test {
 protected:
  Model model{loaded_duffing()};
  Continuation continuation{model, kLoaded, {{Scheme::order6, 128, true}}};
  Branch branch = continuation.over_amplitude(kOmega / (2.0 * std::numbers::pi), 0.05, 3.0);
  const SpecialPoint* doubling() const {
    for (const SpecialPoint& special : branch.special) {
      if (special.kind == Bifurcation::period_doubling) return &special;
    }
    return nullptr;
  }
};

TEST_F(Doubling, StandsWhereAMultiplierOfTheIntegratedMotionIsMinusOne) {
  ASSERT_NE(doubling(), nullptr);
  const BranchPoint& point = doubling()->point;
  const DuffingInTime plant{kLoaded, 0.8, kOmega, point.amplitude};
  PeriodicSystem system(model, {Scheme::order6, 128, true});
  set_excitation_over(system, 1, kOmega / (2.0 * std::numbers::pi), point.amplitude);
  std::copy(point.at.z.begin(), point.at.z.end(), system.state().begin());
  ASSERT_EQ(system.solve(kLoaded).status, SolveStatus::converged);
  const State start = {system.value(0, 0), system.velocity(0, 0)};
  double m[2][2];
  for (int k = 0; k < 2; ++k) {
    const double h = 1e-5;
    State up = start, down = start;
    up[k] += h;
    down[k] -= h;
    up = plant.after_periods(up, 1);
    down = plant.after_periods(down, 1);
    for (int i = 0; i < 2; ++i)
      m[i][k] = (up[i] - down[i]) / (2 * h);
  }
  // det(M + 1) = 1 + trace + det.
  EXPECT_NEAR(1.0 + m[0][0] + m[1][1] + m[0][0] * m[1][1] - m[0][1] * m[1][0], 0.0, 1e-6);
}

TEST_F(Doubling, LeadsToTheMotionOfTwoPeriodsThatTheIntegrationSettlesOn) {
  ASSERT_NE(doubling(), nullptr);
  const Branch twice = continuation.doubled(branch, *doubling());
  ASSERT_GT(twice.points.size(), 5u) << twice.ended;
  EXPECT_EQ(twice.periods, 2);
  int compared = 0;
  for (const BranchPoint& point : twice.points) {
    const double share = std::abs(point.harmonics[1]) / std::abs(point.harmonics[2]);
    if (!point.stable || point.floquet.largest() > 0.9 || share < 0.1) continue;
    if (++compared > 3) break;
    const DuffingInTime plant{kLoaded, 0.8, kOmega, point.amplitude};
    PeriodicSystem system(model, {Scheme::order6, 256, true});
    set_excitation_over(system, 2, kOmega / (2.0 * std::numbers::pi), point.amplitude);
    std::copy(point.at.z.begin(), point.at.z.end(), system.state().begin());
    ASSERT_EQ(system.solve(kLoaded).status, SolveStatus::converged);
    EXPECT_GT(subharmonic_share(system, 2), 0.05);
    const State start = {system.value(0, 0), system.velocity(0, 0)};
    const State one = plant.after_periods(start, 1), two = plant.after_periods(start, 2);
    EXPECT_GT(std::fabs(one[0] - start[0]) + std::fabs(one[1] - start[1]), 0.01);
    EXPECT_NEAR(two[0], start[0], 1e-7);
    EXPECT_NEAR(two[1], start[1], 1e-7);
  }
  EXPECT_GT(compared, 0);
}

// Three periods: near three times its natural frequency the Duffing oscillator has a response
// at a third of the excitation's frequency, besides the small one of one period. A record leads
// to it.
TEST(ThreePeriods, AreFoundFromARecordAndFollowedToTheirFold) {
  const Model model(testing::duffing());
  const std::vector<double> theta = {0.02, 1.0, 1.0};
  const double omega = 4.5, amplitude = 10.0;
  const DuffingInTime plant{theta, 0.0, omega, amplitude};
  State settled{};
  std::vector<double> record;
  for (double x0 = 0.5; x0 < 4.0 && record.empty(); x0 += 0.5) {
    for (double v0 = -3.0; v0 <= 3.0 && record.empty(); v0 += 1.5) {
      settled = plant.after_periods({x0, v0}, 600);
      const State one = plant.after_periods(settled, 1), three = plant.after_periods(settled, 3);
      if (std::fabs(three[0] - settled[0]) < 1e-4 && std::fabs(one[0] - settled[0]) > 0.05)
        record = plant.record(settled, 3, 48);
    }
  }
  ASSERT_FALSE(record.empty()) << "the integration found no subharmonic to compare with";
  EXPECT_GT(subharmonic_share(record, 3), 0.3);

  PeriodicSystem system(model, {Scheme::order6, 3 * 128, true});
  set_excitation_over(system, 3, omega / (2.0 * std::numbers::pi), amplitude);
  start_from_record(system, record, 9);
  ASSERT_EQ(system.solve(theta).status, SolveStatus::converged);
  EXPECT_GT(subharmonic_share(system, 3), 0.3);
  for (std::size_t j = 0; j < record.size(); ++j)
    EXPECT_NEAR(system.value(static_cast<int>(j) * 384 / 48, 0), record[j], 2e-3);
  const auto stability = floquet(system, theta);
  ASSERT_TRUE(stability.ok());
  EXPECT_TRUE(stability->stable());

  ContinuationOptions options{{Scheme::order6, 128, true}};
  options.periods = 3;
  options.harmonics = 3;
  Continuation continuation(model, theta, options);
  // Downwards: the response ends in a fold and returns as an unstable one.
  const Branch branch = continuation.from_state(
      Along::frequency, amplitude, omega / (2.0 * std::numbers::pi), 6.0 / (2.0 * std::numbers::pi),
      1.0 / (2.0 * std::numbers::pi), system.state());
  EXPECT_FALSE(branch.complete);
  ASSERT_FALSE(branch.special.empty()) << branch.ended;
  const SpecialPoint& last = branch.special.front();
  EXPECT_EQ(last.kind, Bifurcation::fold) << name(last.kind);
  EXPECT_LT(last.point.frequency_hz, omega / (2.0 * std::numbers::pi));
  EXPECT_TRUE(branch.points[last.after].stable);
  EXPECT_FALSE(branch.points[last.after + 1].stable);
}

TEST(MultiPeriod, SolutionOfOnePeriodIsOneOfManyWithMultipliersToThatPower) {
  const Model model(testing::oleo());
  PeriodicSystem one(model, {Scheme::order6, 160, true}), three(model, {Scheme::order6, 480, true});
  set_excitation_over(one, 1, 2.0, 3.048);
  set_excitation_over(three, 3, 2.0, 3.048);
  ASSERT_EQ(one.solve_from_rest(testing::kOleoSi).status, SolveStatus::converged);
  ASSERT_EQ(three.solve_from_rest(testing::kOleoSi).status, SolveStatus::converged);
  EXPECT_LT(subharmonic_share(three, 3), 1e-9);
  for (int i = 0; i < 480; ++i)
    EXPECT_NEAR(three.value(i, 0), one.value(i % 160, 0), 1e-11);
  const auto a = floquet(one, testing::kOleoSi), b = floquet(three, testing::kOleoSi);
  EXPECT_NEAR(std::abs(std::pow(a->multipliers[0], 3) - b->multipliers[0]) *
                  std::abs(std::pow(a->multipliers[0], 3) - b->multipliers[1]),
              0.0, 1e-9);
}

}  // namespace
}  // namespace shaker::estimator
