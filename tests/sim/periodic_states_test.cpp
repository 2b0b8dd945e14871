// The simulated oleo must settle on the periodic solutions that other programs computed.
#include <algorithm>
#include <cmath>
#include <complex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/integrator.hpp"
#include "tests/sim/csv.hpp"

namespace shaker::sim {
namespace {

using testing::read_csv;
using testing::Row;

struct Orbit {
  State start{};
  double u_min = 1e9, u_max = -1e9;
  double quarters[4] = {};
};

// The state at the crest of the excitation after many periods, and the extremes of one more
// period.
Orbit settle(const Plant& plant, double f, double amplitude, int periods) {
  TableMotion table;
  table.go_to(0.0, f, amplitude, 0.0);
  Integrator it(plant, plant.at_rest(), 0.0);
  it.advance(periods / f, table);
  Orbit orbit;
  orbit.start = it.state();
  constexpr int kParts = 4000;
  for (int i = 0; i < kParts; ++i) {
    if (i % (kParts / 4) == 0) orbit.quarters[i / (kParts / 4)] = it.state()[0];
    it.advance((periods + (i + 1.0) / kParts) / f, table);
    orbit.u_min = std::min(orbit.u_min, it.state()[0]);
    orbit.u_max = std::max(orbit.u_max, it.state()[0]);
  }
  return orbit;
}

// The printed states use the exactly converted theta of the paper, and the extremes are from a
// grid: hence 1e-7 for the velocity and 2e-6 for the extremes.
TEST(PeriodicStates, OfTheOleoInSiMatchThePrintedDigits) {
  const auto rows = read_csv(SHAKER_TEST_DATA "/oleo_periodic_si.csv");
  ASSERT_EQ(rows.size(), 4u);
  const Plant plant("oleo", {{"theta1", 5.08 / 0.3048}, {"theta3", 1.62 / 0.3048}});
  for (const Row& row : rows) {
    const Orbit orbit = settle(plant, row.at("f"), row.at("A"), 120);
    SCOPED_TRACE(::testing::Message() << row.at("f") << " Hz, " << row.at("A") << " m/s^2");
    EXPECT_NEAR(orbit.start[0], row.at("u0"), 1e-8);
    EXPECT_NEAR(orbit.start[1], row.at("v0"), row.at("A") == 10.0 ? 5e-6 : 1e-7);
    EXPECT_NEAR(orbit.u_min, row.at("u_min"), 2e-6);
    EXPECT_NEAR(orbit.u_max, row.at("u_max"), 2e-6);
  }
}

Plant plant_in_feet(double gravity) {
  return Plant("oleo", {{"theta1", 5.08}, {"theta2", 5.0}, {"theta3", 1.62}, {"gravity", gravity}});
}

TEST(PeriodicStates, OfThePapersExcitationsMatchToTenDigits) {
  const auto rows = read_csv(SHAKER_TEST_DATA "/oleo_periodic_feet.csv");
  ASSERT_EQ(rows.size(), 6u);
  for (const Row& row : rows) {
    const Plant plant = plant_in_feet(row.at("grav"));
    const Orbit orbit = settle(plant, row.at("f"), row.at("amp"), 80);
    SCOPED_TRACE(::testing::Message() << row.at("f") << " Hz, " << row.at("amp") << " ft/s^2");
    EXPECT_NEAR(orbit.start[0], row.at("u0"), 1e-10);
    EXPECT_NEAR(orbit.start[1], row.at("v0"), 1e-9);
    EXPECT_NEAR(orbit.quarters[1], row.at("u_quarter"), 1e-10);
    EXPECT_NEAR(orbit.quarters[2], row.at("u_half"), 1e-10);
    EXPECT_NEAR(orbit.quarters[3], row.at("u_three_quarters"), 1e-10);
  }
}

// Differences of the period map around the orbit.
std::complex<double> multiplier(const Plant& plant, const State& on_orbit, double f, double amp) {
  constexpr double kStep = 1e-6;
  double m[2][2];
  for (int j = 0; j < 2; ++j) {
    for (int sign : {+1, -1}) {
      State s = on_orbit;
      s[static_cast<std::size_t>(j)] += sign * kStep;
      TableMotion table;
      table.go_to(0.0, f, amp, 0.0);
      Integrator it(plant, s, 0.0);
      it.advance(1.0 / f, table);
      for (int i = 0; i < 2; ++i) {
        const double part = sign * it.state()[static_cast<std::size_t>(i)] / (2.0 * kStep);
        m[i][j] = sign > 0 ? part : m[i][j] + part;
      }
    }
  }
  const double half_trace = 0.5 * (m[0][0] + m[1][1]);
  const double determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
  return half_trace + std::sqrt(std::complex<double>(half_trace * half_trace - determinant));
}

TEST(PeriodicStates, AttractWithTheKnownFloquetMultipliers) {
  for (const Row& row : read_csv(SHAKER_TEST_DATA "/oleo_periodic_feet.csv")) {
    const Plant plant = plant_in_feet(row.at("grav"));
    const Orbit orbit = settle(plant, row.at("f"), row.at("amp"), 80);
    const auto mu = multiplier(plant, orbit.start, row.at("f"), row.at("amp"));
    SCOPED_TRACE(::testing::Message() << row.at("f") << " Hz, " << row.at("amp") << " ft/s^2");
    EXPECT_NEAR(mu.real(), row.at("floquet_re"), 2e-6);
    EXPECT_NEAR(std::abs(mu.imag()), row.at("floquet_im"), 2e-6);
  }
}

}  // namespace
}  // namespace shaker::sim
