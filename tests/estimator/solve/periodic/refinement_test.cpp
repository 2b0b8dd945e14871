// Starts the solution on a finer grid from that on a coarser one.
#include "estimator/solve/periodic/internal/refinement.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/math/aligned.hpp"
#include "estimator/solve/periodic/periodic_lanes.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr double kFrequency = 2.0;

// A wave with its derivatives on a cyclic grid; the first point is repeated at the end.
struct Wave {
  std::vector<double> u, v, a;
  explicit Wave(int points, double phase = 0.3) {
    const double omega = 2.0 * std::numbers::pi * kFrequency;
    for (int i = 0; i <= points; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i % points) / points + phase;
      u.push_back(std::sin(angle));
      v.push_back(omega * std::cos(angle));
      a.push_back(-omega * omega * std::sin(angle));
    }
  }
  CoarseRing ring() const {
    const int points = static_cast<int>(u.size()) - 1;
    return {points, 1.0 / (kFrequency * points), u.data(), v.data(), a.data()};
  }
};

double largest_error(int coarse, int fine) {
  const Wave from(coarse), want(fine);
  std::vector<double> z(static_cast<std::size_t>(fine));
  refine(from.ring(), fine, z.data());
  double worst = 0.0;
  for (std::size_t i = 0; i < z.size(); ++i)
    worst = std::max(worst, std::fabs(z[i] - want.u[i]));
  return worst;
}

TEST(Refinement, LeavesPointsThatBothRingsHaveAsTheyAre) {
  const Wave wave(40);
  std::vector<double> z(120);
  refine(wave.ring(), 40, z.data());
  for (std::size_t i = 0; i < 40; ++i)
    EXPECT_EQ(z[i], wave.u[i]) << i;
  refine(wave.ring(), 120, z.data());
  for (std::size_t i = 0; i < 40; ++i)
    EXPECT_EQ(z[3 * i], wave.u[i]) << i;
}

// For any ratio of points; the error of the quintic is 1/46080 of the sixth derivative.
TEST(Refinement, IsOfSixthOrderBetweenThem) {
  for (const int fine : {80, 97, 140, 280}) {
    const double step = 2.0 * std::numbers::pi / 40.0;
    EXPECT_LT(largest_error(40, fine), 1.01 * std::pow(step, 6.0) / 46080.0) << fine;
    EXPECT_GT(largest_error(40, fine) / largest_error(80, 2 * fine), 50.0) << fine;
  }
}

TEST(Refinement, IsTheSameAbreast) {
  constexpr int kCoarse = 40, kFine = 72;
  AlignedVector u(kCoarse * kLanes), v(u), a(u), z(kFine * kLanes);
  CoarseLanes lanes{kCoarse, {}, as_lanes(u.data()), as_lanes(v.data()), as_lanes(a.data())};
  for (int lane = 0; lane < kLanes; ++lane) {
    const Wave wave(kCoarse, 0.1 * lane);
    for (int i = 0; i < kCoarse; ++i) {
      const auto from = static_cast<std::size_t>(i),
                 to = static_cast<std::size_t>(kLanes * i + lane);
      u[to] = wave.u[from];
      v[to] = wave.v[from];
      a[to] = wave.a[from];
    }
    lanes.step[lane] = wave.ring().step;
  }
  refine_lanes(lanes, kFine, as_lanes(z.data()));
  std::vector<double> alone(kFine);
  for (int lane = 0; lane < kLanes; ++lane) {
    const Wave wave(kCoarse, 0.1 * lane);
    refine(wave.ring(), kFine, alone.data());
    for (int i = 0; i < kFine; ++i)
      EXPECT_NEAR(z[static_cast<std::size_t>(kLanes * i + lane)],
                  alone[static_cast<std::size_t>(i)], 1e-15);
  }
}

// Including velocity reversals: for an excitation of 10 ft/s^2 a cubic through four points
// leaves 0.71.
TEST(Refinement, LeavesLittleOfTheResidualOnTheFinerGrid) {
  const Model model(testing::oleo(32.2));
  const std::vector<double> theta = {5.08, 5.0, 1.62, 1.0};
  PeriodicSystem coarse(model, {Scheme::order6, 60, true});
  PeriodicSystem fine(model, {Scheme::order6, 120, true});
  for (PeriodicSystem* system : {&coarse, &fine})
    system->set_excitation(kFrequency, 10.0);
  ASSERT_EQ(coarse.solve_from_rest(theta).status, SolveStatus::converged);
  fine.interpolate_from(coarse);
  ASSERT_TRUE(fine.linearise(theta));
  EXPECT_LT(fine.residual(), 0.02);
}

}  // namespace
}  // namespace shaker::estimator
