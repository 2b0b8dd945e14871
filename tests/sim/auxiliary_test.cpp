// Compares the auxiliary quantities with Newton's law, the gas law and derivatives of other
// channels.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/virtual_rig.hpp"

namespace shaker::sim {
namespace {

using namespace std::chrono_literals;

struct Dwell {
  std::vector<RigSample> samples;
  std::map<std::string, double> truth;
};

// Two seconds of a steady dwell at 2 Hz, 3 m/s^2, 1 kHz, without noise of stroke and table.
Dwell dwell(std::vector<std::string> wanted) {
  RigOptions options;
  options.auxiliary = std::move(wanted);
  options.noise_m = options.noise_m_s2 = options.quantum_m = options.quantum_m_s2 = 0.0;
  options.heartbeat_timeout_s = 0.0;
  VirtualRig rig(options, 0ns);
  rig.set_frequency(2.0);
  rig.set_amplitude(3.0);
  rig.set_enable(true);
  Dwell run;
  rig.advance(10s, run.samples);
  run.samples.clear();
  rig.advance(12s, run.samples);
  run.truth = rig.true_parameters();
  return run;
}

double central(const Dwell& run, std::size_t i, double (*value)(const RigSample&)) {
  return (value(run.samples[i + 1]) - value(run.samples[i - 1])) / 2e-3;
}

TEST(Auxiliary, QuantitiesObeyNewtonAndTheGasLaw) {
  const Dwell run = dwell({"gas_pressure", "damper_force", "mass_acceleration", "stroke_velocity"});
  ASSERT_GE(run.samples.size(), 1999u);
  const auto stroke = [](const RigSample& s) { return s.displacement; };
  for (std::size_t i = 10; i < 1900; i += 7) {
    const RigSample& s = run.samples[i];
    const double column = 1.0 - run.truth.at("theta3") * s.displacement;
    EXPECT_NEAR(s.auxiliary[0], kMass * run.truth.at("theta2") / column / kPistonArea, 1100.0);
    // The load cell measures the weight of the mass and the force that accelerates it.
    EXPECT_NEAR(s.auxiliary[1], kMass * (s.auxiliary[2] + run.truth.at("gravity")), 40.0);
    EXPECT_NEAR(s.auxiliary[3], central(run, i, stroke), 6e-3);
    // The stroke is the table's position minus that of the mass: u'' = x - acceleration of the
    // mass.
    const double bend = (run.samples[i + 10].displacement - 2.0 * s.displacement +
                         run.samples[i - 10].displacement) /
                        1e-4;
    EXPECT_NEAR(bend, s.excitation - s.auxiliary[2], 0.15);
  }
}

TEST(Auxiliary, TableMovesAsItsAccelerationSays) {
  const Dwell run = dwell({"table_acceleration_2", "table_velocity", "table_position"});
  const double omega = 4.0 * std::numbers::pi;
  double most = 0.0;
  for (std::size_t i = 10; i < 1900; i += 7) {
    const RigSample& s = run.samples[i];
    EXPECT_NEAR(s.auxiliary[0], s.excitation, 0.06);
    EXPECT_NEAR(s.auxiliary[2], -s.excitation / (omega * omega), 2e-4);
    most = std::max(most, s.auxiliary[1]);
    const double rise = run.samples[i + 10].auxiliary[2] - run.samples[i - 10].auxiliary[2];
    EXPECT_NEAR(s.auxiliary[1], rise / 20e-3, 0.012);
  }
  EXPECT_NEAR(most, 3.0 / omega, 1e-3);
}

TEST(Auxiliary, OilWarmsByTheWorkDone) {
  const Dwell run = dwell({"oil_temperature", "mass_acceleration", "stroke_velocity"});
  const auto mean = [&](std::size_t from) {
    double sum = 0.0;
    for (std::size_t i = from; i < from + 200; ++i)
      sum += run.samples[i].auxiliary[0] / 200.0;
    return sum;
  };
  // From the middle of the first 200 samples to that of the last: 1.7 s. 2000 J/K, 12 W/K to 20 C.
  double heat = 0.0;
  for (std::size_t i = 100; i < 1800; ++i) {
    const auto& now = run.samples[i].auxiliary;
    heat += 1e-3 * (kMass * now[1] * now[2] - 12.0 * (now[0] - 20.0));
  }
  EXPECT_GT(heat / 2000.0, 0.02);
  EXPECT_NEAR(mean(1700) - mean(0), heat / 2000.0, 0.01);
}

TEST(Auxiliary, LeaveTheOtherChannelsAsTheyWere) {
  RigOptions bare, full;
  full.auxiliary = {"gas_pressure", "oil_temperature"};
  std::vector<RigSample> a, b;
  VirtualRig(bare, 0ns).advance(100ms, a);
  VirtualRig(full, 0ns).advance(100ms, b);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].displacement, b[i].displacement);
    EXPECT_EQ(a[i].excitation, b[i].excitation);
  }
}

TEST(Auxiliary, UnknownQuantityIsNamedWithThoseThereAre) {
  RigOptions options;
  options.auxiliary = {"gas_presure"};
  try {
    VirtualRig rig(options, 0ns);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("'gas_presure' is unknown"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("gas_pressure"), std::string::npos);
  }
}

}  // namespace
}  // namespace shaker::sim
