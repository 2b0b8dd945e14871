// Checks the hidden effects against their formulas from outside: energy, friction,
// thermodynamics.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/integrator.hpp"
#include "sim/plant.hpp"

namespace shaker::sim {
namespace {

using std::numbers::pi;
using Given = std::map<std::string, double>;

constexpr double kG = 9.80665, kTheta1 = 16.6667, kTheta2 = 1.524, kTheta3 = 5.31496;

// The force per unit mass at (u, v), from the plant's acceleration.
double force(const Given& given, double u, double v) {
  const Plant plant("oleo", given);
  State s = plant.at_rest();
  s[0] = u;
  s[1] = v;
  const double direction = v > 0 ? 1.0 : v < 0 ? -1.0 : 0.0;
  return -plant.rate(s, direction, 0.0)[1];
}
double extra(const Given& given, double u, double v) {
  return force(given, u, v) - force({}, u, v);
}

TEST(Parts, AddTheForcesOfTheirFormulas) {
  const double u = 0.15, v = 0.2, gas = kTheta2 / (1 - kTheta3 * u);
  EXPECT_NEAR(force({}, u, v), kTheta1 * v * v + gas - kG, 1e-12);
  EXPECT_NEAR(force({}, u, -v), -kTheta1 * v * v + gas - kG, 1e-12);
  EXPECT_NEAR(force({{"theta4", 1.3}}, u, v),
              kTheta1 * v * v + kTheta2 * std::pow(1 - kTheta3 * u, -1.3) - kG, 1e-12);
  EXPECT_NEAR(extra({{"viscous_damping", 3.0}}, u, -v), -0.6, 1e-12);
  EXPECT_NEAR(extra({{"coulomb_friction", 0.4}}, u, -v), -0.4, 1e-12);
  EXPECT_NEAR(
      extra({{"coulomb_friction", 0.4}, {"stribeck_ratio", 2}, {"stribeck_speed", v}}, u, v),
      0.4 * (1 + std::exp(-1.0)), 1e-12);
  EXPECT_NEAR(extra({{"pressure_friction", 0.1}}, u, v), 0.1 * gas, 1e-12);
  EXPECT_NEAR(extra({{"cubic_stiffness", 1000}, {"cubic_stiffness_centre", 0.1}}, u, v), 0.125,
              1e-12);
  EXPECT_NEAR(extra({{"linear_stiffness", 10}, {"linear_stiffness_centre", 0.1}}, u, v), 0.5,
              1e-12);
  EXPECT_NEAR(extra({{"end_stop_stiffness", 100}, {"end_stop_position", 0.14}}, u, v), 1.0, 1e-12);
  EXPECT_EQ(extra({{"end_stop_stiffness", 100}, {"end_stop_position", 0.16}}, u, v), 0.0);
  EXPECT_NEAR(extra({{"rebound_factor", 3}}, u, -v), -2 * kTheta1 * v * v, 1e-12);
  EXPECT_EQ(extra({{"rebound_factor", 3}}, u, v), 0.0);
  EXPECT_NEAR(extra({{"cavitation_force", 0.5}}, u, -v), kTheta1 * v * v - 0.5, 1e-12);
  EXPECT_NEAR(extra({{"laminar_speed", 5.0}}, u, 1e-3), kTheta1 * 1e-3 * (5.0 - 1e-3), 1e-6);
  const double xi = u / 0.19;
  EXPECT_NEAR(extra({{"metering_k1", 0.3}}, u, v),
              kTheta1 * v * v * (std::pow(1 - 0.3 * xi, -2) - 1), 1e-12);
  EXPECT_NEAR(extra({{"relief_force", 0.2}, {"relief_share", 0.25}}, u, v),
              -0.75 * (kTheta1 * v * v - 0.2), 1e-12);
  EXPECT_EQ(extra({{"relief_force", 0.2}}, u, -v), 0.0);
  EXPECT_EQ(extra({{"relief_force", 1.0}}, u, v), 0.0);
  EXPECT_NEAR(extra({{"second_chamber_knee", 0.14}, {"second_chamber_share", 0.5}}, u, v),
              kTheta2 / (1 - kTheta3 * 0.145) - gas, 1e-12);
  EXPECT_EQ(extra({{"second_chamber_knee", 0.16}}, u, v), 0.0);
  EXPECT_NEAR(extra({{"gas_virial", 0.01}}, u, v), gas * 0.01 * kTheta3 * u / (1 - kTheta3 * u),
              1e-12);
  EXPECT_NEAR(extra({{"detent_force", 0.3}, {"detent_pitch", 0.04}}, u, v),
              0.3 * std::sin(2 * pi * u / 0.04), 1e-12);
  EXPECT_NEAR(extra({{"notch_factor", 1.5}, {"notch_centre", u}}, u, v),
              0.5 * std::tanh(2.5) * kTheta1 * v * v, 1e-12);
  EXPECT_NEAR(extra({{"notch_factor", 1.5}, {"notch_centre", 0.16}}, u, v), 0.0, 1e-3);
  EXPECT_NEAR(extra({{"leaning_friction", 20}, {"leaning_middle", 0.16}}, u, -v), -0.2, 1e-12);
  EXPECT_NEAR(force({{"added_mass", 0.25}}, u, v), force({}, u, v) / 1.25, 1e-12);
}

TEST(FreePlay, LeavesTheSpringSlackInItsGap) {
  const Plant plant("linear", {{"theta1", 0.0}, {"theta2", 100.0}, {"free_play", 0.01}});
  const auto pull = [&](double u) {
    State s{};
    s[0] = u;
    return -plant.rate(s, 1.0, 0.0)[1];
  };
  EXPECT_EQ(pull(0.005), 0.0);
  EXPECT_NEAR(pull(0.03), 2.0, 1e-12);
  EXPECT_NEAR(pull(-0.03), -2.0, 1e-12);
}

TEST(Parts, OffByDefault) {
  for (const auto& entry : plant_table()) {
    const Plant plant(entry.name, {});
    for (const auto& parameter : parameters_of(entry)) {
      EXPECT_EQ(plant.values().at(std::string(parameter.name)), parameter.standard);
    }
  }
}

TEST(Plant, RefusesWhatItDoesNotKnow) {
  const auto message = [](std::string_view plant, const Given& given) -> std::string {
    try {
      Plant made(plant, given);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message("olea", {}), ::testing::HasSubstr("'olea' is unknown; choose one of oleo"));
  EXPECT_THAT(message("oleo", {{"theta9", 1}}), ::testing::HasSubstr("no parameter 'theta9'"));
  EXPECT_THAT(message("oleo", {{"theta3", -1}}), ::testing::HasSubstr("theta3 = -1"));
  EXPECT_THAT(message("oleo", {{"theta1", std::nan("")}}), ::testing::HasSubstr("theta1 = nan"));
}

// The linear oscillator's response is known in closed form.
TEST(Linear, AnswersWithTheTransferFunctionsAmplitudeAndPhase) {
  const Plant plant("linear", {{"theta1", 3.0}, {"theta2", 200.0}});
  const double f = 2.5, omega = 2 * pi * f, amplitude = 4.0;
  TableMotion table;
  table.go_to(0.0, f, amplitude, 0.0);
  Integrator it(plant, plant.at_rest(), 0.0);
  it.advance(40.0, table);
  const std::complex<double> u =
      amplitude / std::complex<double>(200.0 - omega * omega, 3.0 * omega);
  EXPECT_NEAR(it.state()[0], u.real(), 1e-9);
  EXPECT_NEAR(it.state()[1], -omega * u.imag(), 1e-8);
}

// A block on a spring with dry friction loses 4 f_c / k of its swing in each turn and stops
// suddenly.
TEST(Friction, TakesAConstantStepFromEachSwingAndThenSticks) {
  const double k = 100.0, friction = 0.5;
  const Plant plant("linear", {{"theta1", 0.0}, {"theta2", k}, {"coulomb_friction", friction}});
  const TableMotion still;
  State start{};
  start[0] = 0.044;
  Integrator it(plant, start, 0.0);
  const double half = pi / std::sqrt(k);
  for (int i = 1; i <= 4; ++i) {
    it.advance(i * half, still);
    EXPECT_NEAR(std::abs(it.state()[0]), 0.044 - 2 * i * friction / k, 1e-9) << i;
  }
  it.advance(10.0, still);
  EXPECT_TRUE(it.stuck());
  EXPECT_EQ(it.state()[1], 0.0);
  EXPECT_NEAR(it.state()[0], 0.004, 1e-9);  // after four halves; 0.5 m/s^2 hold 0.4 m/s^2
}

TEST(Friction, HoldsTheDamperUntilTheTableBreaksItAway) {
  const Plant plant("oleo", {{"coulomb_friction", 1.0}});
  TableMotion table;
  table.go_to(0.0, 0.5, 0.9, 0.0);
  Integrator it(plant, plant.at_rest(), 0.0);
  it.advance(10.0, table);
  EXPECT_TRUE(it.stuck());
  EXPECT_EQ(it.state()[0], plant.at_rest()[0]);

  // A ramp of 1 m/s^2 in 5 s (at frequency 0): the block breaks away at the level of friction.
  TableMotion ramp;
  ramp.go_to(0.0, 0.0, 2.0, 10.0);
  Integrator slow(plant, plant.at_rest(), 0.0);
  slow.advance(4.999, ramp);
  EXPECT_TRUE(slow.stuck());
  slow.advance(5.2, ramp);
  EXPECT_FALSE(slow.stuck());
  EXPECT_GT(slow.state()[0], plant.at_rest()[0]);
}

// The work of the table over one period equals the heat of orifice and friction.
TEST(Energy, OfThePeriodBalances) {
  const Given given = {{"coulomb_friction", 0.3}, {"viscous_damping", 0.5}};
  const Plant plant("oleo", given);
  TableMotion table;
  table.go_to(0.0, 2.0, 4.0, 0.0);
  Integrator it(plant, plant.at_rest(), 0.0);
  it.advance(40.0, table);
  constexpr int n = 20000;
  double in = 0.0, out = 0.0;
  const State before = it.state();
  for (int i = 0; i < n; ++i) {
    it.advance(40.0 + (i + 1) * 0.5 / n, table);
    const double v = it.state()[1];
    in += table.acceleration(it.time()) * v;
    out += kTheta1 * std::abs(v * v * v) + 0.3 * std::abs(v) + 0.5 * v * v;
  }
  EXPECT_NEAR(it.state()[0], before[0], 1e-9);
  EXPECT_GT(in, 0.0);
  EXPECT_NEAR(in / out, 1.0, 1e-6);
}

// The gas between its two limits: slow compression is isothermal, fast compression adiabatic.
TEST(GasHeat, TendsToTheIsothermAndToTheAdiabate) {
  const auto temperature_at_end = [](double tau) {
    const Plant plant("oleo", {{"gas_heat_tau", tau}});
    State s = plant.at_rest();
    double column_before = 1 - kTheta3 * s[0];
    TableMotion table;
    table.go_to(0.0, 2.0, 3.0, 0.0);
    Integrator it(plant, s, 0.0);
    double worst = 0.0;
    for (int i = 1; i <= 100; ++i) {
      it.advance(i * 0.005, table);
      const double column = 1 - kTheta3 * it.state()[0];
      const double adiabate = std::pow(column / column_before, -0.4);
      const double target = tau > 1.0 ? adiabate : 1.0;
      worst = std::max(worst, std::abs(it.state()[2] - target));
    }
    return worst;
  };
  EXPECT_LT(temperature_at_end(1e5), 1e-4);
  EXPECT_LT(temperature_at_end(1e-4), 1e-3);
  EXPECT_GT(temperature_at_end(0.2), 1e-2);
}

TEST(BoucWen, YieldsAndDissipates) {
  const Plant plant("bouc_wen", {});
  TableMotion table;
  table.go_to(0.0, 1.0, 3.0, 0.0);
  Integrator it(plant, plant.at_rest(), 0.0);
  it.advance(30.0, table);
  double loop = 0.0, z_max = 0.0;
  for (int i = 0; i < 2000; ++i) {
    it.advance(30.0 + (i + 1) / 2000.0, table);
    loop += it.state()[2] * it.state()[1] / 2000.0;
    z_max = std::max(z_max, std::abs(it.state()[2]));
  }
  EXPECT_GT(loop, 0.0);                  // the hysteresis absorbs energy
  EXPECT_LT(z_max, 1.0 / 150.0 + 1e-9);  // ultimate strength (a / (b + c))^(1/n)
  EXPECT_GT(z_max, 0.5 / 150.0);
}

// After a long motion in one direction the Dahl friction is f_c; on the way f_c (1 - exp(-u /
// z0)).
TEST(PreslidingFriction, BuildsUpOverItsDistance) {
  const double z0 = 1e-3, level = 0.4;
  const Given given = {{"presliding_friction", level}, {"presliding_distance", z0}};
  const Plant plant("linear", given);
  State s{};
  s[1] = 1e-6;
  double u = 0.0;
  for (int i = 0; i < 3000; ++i) {  // a very slow motion; only the memory state is integrated
    s[2] += plant.rate(s, 1.0, 0.0)[2];
    u += s[1];
  }
  const State still = [&] {
    State at = s;
    at[2] = 0.0;
    return at;
  }();
  const double friction = plant.rate(still, 1.0, 0.0)[1] - plant.rate(s, 1.0, 0.0)[1];
  EXPECT_NEAR(friction, level * (1 - std::exp(-u / z0)), 1e-3 * level);
}

// Stiff oil acts like no oil spring; soft oil lags, and the orifice passes v on average.
TEST(OilCompressibility, TendsToTheRigidOrifice) {
  const auto stroke = [](const Given& given) {
    const Plant plant("oleo", given);
    TableMotion table;
    table.go_to(0.0, 2.0, 3.0, 0.0);
    Integrator it(plant, plant.at_rest(), 0.0);
    it.advance(5.1, table);
    return it.state()[0];
  };
  const double rigid = stroke({});
  const double stiff = stroke({{"oil_stiffness", 1e5}, {"oil_laminar_speed", 1e-3}});
  const double soft = stroke({{"oil_stiffness", 1e3}, {"oil_laminar_speed", 1e-3}});
  EXPECT_LT(std::abs(stiff - rigid), 2e-5);
  EXPECT_GT(std::abs(soft - rigid), 1e-4);
}

// Checks the equations of the oleo on its tyre at one state.
TEST(Tyre, IsTheDampersBaseOfSecondOrder) {
  const double k = 2000.0, c = 8.0, m = 0.1;
  const Plant plant("oleo", {{"tyre_stiffness", k}, {"tyre_damping", c}, {"unsprung_mass", m}});
  State s = plant.at_rest();
  const State rest = plant.rate(s, 1.0, 0.0);
  for (const double value : rest) {
    EXPECT_NEAR(value, 0.0, 1e-9);
  }
  s[0] += 0.01;
  s[1] = 0.2;
  s[2] += 0.003;
  s[3] = -0.1;
  const State rate = plant.rate(s, 1.0, 1.5);
  const double damper = kTheta1 * 0.04 + kTheta2 / (1 - kTheta3 * s[0]);
  const double sinking = 1.5 + kG + (damper - k * s[2] - c * s[3]) / m;
  EXPECT_NEAR(rate[2], -0.1, 1e-15);
  EXPECT_NEAR(rate[3], sinking, 1e-9);
  EXPECT_NEAR(rate[1], 1.5 - damper + kG - sinking, 1e-9);
  // The centre of both masses moves as the table and the tyre alone determine.
  EXPECT_NEAR((rate[1] + rate[3]) + m * rate[3], 1.5 * (1 + m) + kG * (1 + m) - k * s[2] - c * s[3],
              1e-9);
  EXPECT_THROW(Plant("oleo", {{"tyre_stiffness", k}, {"coulomb_friction", 0.2}}),
               std::invalid_argument);
}

TEST(GasWall, IsSaidRatherThanOverflown) {
  const Plant plant("oleo", {});
  TableMotion table;
  table.go_to(0.0, 1.0, 45.0, 0.0);
  Integrator it(plant, plant.at_rest(), 0.0);
  bool bottomed = false;
  for (int i = 1; i <= 5000; ++i) {
    it.advance(i * 1e-3, table);
    ASSERT_TRUE(std::isfinite(it.state()[0]) && std::isfinite(it.state()[1]));
    ASSERT_LE(it.state()[0], *plant.wall());
    bottomed = it.take_bottomed() || bottomed;
  }
  EXPECT_TRUE(bottomed);
}

TEST(TableMotion, KeepsItsPhaseWhileFrequencyAndAmplitudeRamp) {
  TableMotion table;
  table.go_to(0.0, 1.0, 2.0, 0.0);
  table.go_to(3.3, 4.0, 5.0, 2.0);
  double before = table.phase(3.3);
  double turns = 0.0;
  for (int i = 1; i <= 200000; ++i) {
    const double t = 3.3 + i * 2.0 / 200000;
    const double step = table.phase(t) - before;
    ASSERT_NEAR(step, 2 * pi * table.frequency(t) * 1e-5, 1e-8);
    before = table.phase(t);
    turns += step / (2 * pi);
  }
  EXPECT_NEAR(turns, 5.0, 1e-9);  // 2 s at 2.5 Hz on average
  EXPECT_NEAR(table.acceleration(5.3), 5.0 * std::cos(2 * pi * (3.3 + 5.0)), 1e-9);
  EXPECT_NEAR(table.amplitude(4.3), 3.5, 1e-12);
}

}  // namespace
}  // namespace shaker::sim
