// The correction at reversals of |v| v on states far from any solution, as after a trial step:
// it must stay bounded.
#include <cmath>
#include <vector>

#include <gmock/gmock.h>

#include "estimator/solve/periodic/periodic_lanes.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr int kKinkPoints = 160;
constexpr double kSwing = 0.05;
constexpr GridOptions kGrid{Scheme::order6, kKinkPoints, true};
const std::vector<double> kTheta = {40.0, 5.0, 1.62, 1.0};  // of the oleo, feet

// A rough state, as after a step into the gas wall: kappa |a| h^2 is about 10 (kappa 4 theta1,
// a 2000 ft/s^2).
double violent(int point) {
  return 0.3 + kSwing * std::sin(0.3 * point * point);
}

// Plain second differences are at most 4.2 times the swing over h^2; the corrections may
// increase this by 16 at most. Without a limit they exceed any bound.
double most() {
  return 16.0 * 4.2 * kSwing * kKinkPoints * kKinkPoints;
}

void expect_sound(const PeriodicSystem& system) {
  for (int i = 0; i < system.points(); ++i) {
    ASSERT_TRUE(std::isfinite(system.velocity(i, 0))) << i;
    ASSERT_LT(std::fabs(system.acceleration(i, 0)), most()) << i;
  }
}

TEST(ReversalCorrection, DoesNotRunAwayOnAViolentTrialState) {
  const Model model(testing::oleo(32.178));
  PeriodicSystem system(model, kGrid);
  system.set_excitation(1.0, 10.0);
  system.begin();
  for (int i = 0; i < kKinkPoints; ++i)
    system.state()[static_cast<std::size_t>(i)] = violent(i);
  for (int step = 0; step < 30; ++step)
    ASSERT_TRUE(system.linearise(kTheta));
  expect_sound(system);
}

TEST(ReversalCorrection, DoesNotRunAwayInLanesEither) {
  const Model model(testing::oleo(32.178));
  PeriodicSystem system(model, kGrid);
  system.set_excitation(1.0, 10.0);
  PeriodicLanes lanes(model, kGrid, true);
  lanes.begin();
  for (int lane = 0; lane < kLanes; ++lane) {
    lanes.set_excitation(lane, system);
    for (int i = 0; i < kKinkPoints; ++i)
      lanes.state()[kLanes * i + lane] = violent(i);
    for (std::size_t k = 0; k < kTheta.size(); ++k)
      lanes.theta()[kLanes * k + static_cast<std::size_t>(lane)] = kTheta[k];
  }
  for (int step = 0; step < 30; ++step)
    ASSERT_EQ(lanes.linearise(), kAllLanes);
  for (int lane = 0; lane < kLanes; ++lane) {
    lanes.give(lane, system);
    expect_sound(system);
  }
}

}  // namespace
}  // namespace shaker::estimator
