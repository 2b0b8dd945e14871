// The virtual rig from its users' view: controller, dead-man, sensor imperfections, faults.
#include "sim/virtual_rig.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <set>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::sim {
namespace {

using namespace std::chrono_literals;
using std::numbers::pi;
using Samples = std::vector<RigSample>;
constexpr Nanoseconds kStart = 5s;

RigOptions quiet() {
  RigOptions options;
  options.noise_m = options.noise_m_s2 = options.quantum_m = options.quantum_m_s2 = 0.0;
  options.heartbeat_timeout_s = 0.0;
  return options;
}

void start(VirtualRig& rig, double f = 2.0, double a = 3.0, double ramp = 0.0) {
  ASSERT_TRUE(rig.set_ramp(ramp) && rig.set_frequency(f) && rig.set_amplitude(a));
  ASSERT_TRUE(rig.set_enable(true));
}

Samples run(VirtualRig& rig, double until_s) {
  Samples samples;
  rig.advance(kStart + from_seconds(until_s), samples);
  return samples;
}

double mean(const Samples& samples, auto value) {
  double sum = 0.0;
  for (const auto& s : samples)
    sum += value(s);
  return sum / static_cast<double>(samples.size());
}
double deviation(const Samples& samples, auto value) {
  const double m = mean(samples, value);
  return std::sqrt(mean(samples, [&](const RigSample& s) { return std::pow(value(s) - m, 2); }));
}
const auto kStroke = [](const RigSample& s) { return s.displacement; };
const auto kTable = [](const RigSample& s) { return s.excitation; };

TEST(Controller, RampsUpFromZeroAndReportsIt) {
  VirtualRig rig(quiet(), kStart);
  start(rig, 2.0, 3.0, 2.0);
  run(rig, 1.0);
  EXPECT_NEAR(rig.status().amplitude, 1.5, 1e-12);
  EXPECT_TRUE(rig.status().running);
  EXPECT_TRUE(rig.status().ready);
  const Samples later = run(rig, 3.0);
  EXPECT_NEAR(rig.status().amplitude, 3.0, 1e-12);
  double largest = 0.0;
  for (const auto& s : later)
    largest = std::max(largest, std::abs(s.excitation));
  EXPECT_NEAR(largest, 3.0, 1e-9);
  rig.set_amplitude(0.0);
  run(rig, 4.0);
  EXPECT_NEAR(rig.status().amplitude, 1.5, 1e-12);
  run(rig, 6.0);
  EXPECT_FALSE(rig.status().running);
}

TEST(Controller, DisablingStopsAtOnceAndEnablingStartsFromZero) {
  VirtualRig rig(quiet(), kStart);
  start(rig, 2.0, 3.0, 1.0);
  run(rig, 2.0);
  rig.set_enable(false);
  EXPECT_EQ(rig.true_excitation(), 0.0);
  rig.set_enable(true);
  EXPECT_EQ(rig.status().amplitude, 0.0);
  run(rig, 2.5);
  EXPECT_NEAR(rig.status().amplitude, 1.5, 1e-12);
}

TEST(Controller, RefusesWhatItCannotDo) {
  VirtualRig rig(quiet(), kStart);
  EXPECT_FALSE(rig.set_frequency(51.0));
  EXPECT_FALSE(rig.set_frequency(std::nan("")));
  EXPECT_FALSE(rig.set_amplitude(-1.0));
  EXPECT_FALSE(rig.set_ramp(1e9));
  EXPECT_EQ(rig.settings().frequency_hz, 0.0);
}

TEST(DeadMan, StopsTheTableWhenTheHeartbeatStops) {
  RigOptions options = quiet();
  options.heartbeat_timeout_s = 0.5;
  VirtualRig rig(options, kStart);
  start(rig);
  for (int i = 1; i <= 20; ++i) {
    run(rig, 0.1 * i);
    rig.heartbeat(static_cast<std::uint32_t>(i));
  }
  EXPECT_TRUE(rig.status().running);
  for (int i = 21; i <= 24; ++i) {  // the same counter again is no sign of life
    run(rig, 0.1 * i);
    rig.heartbeat(20);
  }
  EXPECT_TRUE(rig.status().running);
  const Samples after = run(rig, 2.6);
  EXPECT_FALSE(rig.status().running);
  EXPECT_EQ(rig.status().fault, 1u);
  for (const auto& s : after) {
    EXPECT_EQ(s.excitation != 0.0, s.t < kStart + 2500ms) << seconds(s.t - kStart);
  }
  EXPECT_FALSE(rig.set_enable(true));  // enabling again does not help
  rig.set_enable(false);
  EXPECT_EQ(rig.status().fault, 0u);
  EXPECT_TRUE(rig.set_enable(true));
}

TEST(DeadMan, IsTheSameWhetherSteppedFinelyOrCoarsely) {
  double stroke[2];
  for (int fine = 0; fine < 2; ++fine) {
    RigOptions options = quiet();
    options.heartbeat_timeout_s = 0.7;
    VirtualRig rig(options, kStart);
    start(rig);
    for (int i = 1; fine && i < 1000; ++i)
      run(rig, i * 1e-3 + 0.0003);
    run(rig, 1.0);
    stroke[fine] = rig.true_stroke();
  }
  EXPECT_NEAR(stroke[0], stroke[1], 1e-12);
}

TEST(Sensors, SampleAtTheirRateWithoutGaps) {
  VirtualRig rig(quiet(), kStart);
  start(rig);
  const Samples samples = run(rig, 2.0);
  ASSERT_EQ(samples.size(), 2000u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(samples[i].t, kStart + (static_cast<int>(i) + 1) * 1ms);
    ASSERT_EQ(samples[i].counter, i + 1);
    ASSERT_EQ(samples[i].device_us, 1000 * (i + 1));
    ASSERT_NEAR(samples[i].excitation,
                3.0 * std::cos(2 * pi * 2.0 * (static_cast<double>(i) + 1) * 1e-3), 1e-9);
  }
  EXPECT_EQ(samples.back().displacement, rig.true_stroke());
}

TEST(Sensors, NoiseHasTheStatedDeviationOnBothChannelsAndNoMean) {
  RigOptions options = quiet();
  options.noise_m = 3e-5;
  options.noise_m_s2 = 7e-3;
  VirtualRig rig(options, kStart);
  const double rest = rig.true_stroke();
  const Samples samples = run(rig, 40.0);
  EXPECT_NEAR(deviation(samples, kStroke), 3e-5, 4e-7);  // 40 000 samples: 0.35 % standard error
  EXPECT_NEAR(deviation(samples, kTable), 7e-3, 1e-4);
  EXPECT_NEAR(mean(samples, kStroke), rest, 6e-7);
  EXPECT_NEAR(mean(samples, kTable), 0.0, 1.5e-4);
}

TEST(Sensors, RepeatWithTheSameSeedAndDifferWithAnother) {
  RigOptions options;
  VirtualRig one(options, kStart), same(options, kStart);
  options.seed = 2;
  VirtualRig other(options, kStart);
  const Samples a = run(one, 0.1), b = run(same, 0.1), c = run(other, 0.1);
  int differing = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].displacement, b[i].displacement);
    differing += a[i].displacement != c[i].displacement;
  }
  EXPECT_GT(differing, 50);
}

TEST(Sensors, QuantiseToTheStep) {
  RigOptions options = quiet();
  options.quantum_m = 1e-3;
  options.quantum_m_s2 = 0.25;
  VirtualRig rig(options, kStart);
  start(rig);
  std::set<long> steps;
  for (const auto& s : run(rig, 3.0)) {
    const double n = s.displacement / 1e-3;
    ASSERT_NEAR(n, std::round(n), 1e-9);
    ASSERT_NEAR(s.excitation * 4, std::round(s.excitation * 4), 1e-9);
    steps.insert(std::lround(n));
  }
  EXPECT_GT(steps.size(), 20u);
}

TEST(Sensors, RunOnTheRigsOwnClock) {
  RigOptions options = quiet();
  options.clock_offset_ppm = 200.0;
  VirtualRig rig(options, kStart);
  start(rig, 2.0, 3.0);
  const Samples samples = run(rig, 1000.0);
  EXPECT_EQ(samples.size(), 1000200u);
  // The excitation runs on that clock too: at sample k its phase is exactly 2 pi f k / rate.
  const auto& s = samples[999749];
  EXPECT_NEAR(s.excitation, 3.0 * std::cos(2 * pi * 2.0 * 999.75), 1e-5);
  EXPECT_NEAR(seconds(s.t - kStart), 999.75 / 1.0002, 1e-8);
  EXPECT_EQ(s.device_us, 999750000u);
}

TEST(Sensors, JitterIsUniformAndLateAndKeepsOrder) {
  RigOptions options = quiet();
  options.jitter_fraction = 0.1;
  VirtualRig rig(options, kStart);
  Samples samples = run(rig, 20.0);
  ASSERT_GE(samples.size(), 19999u);
  double worst = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double late = seconds(samples[i].t - kStart) - 1e-3 * (static_cast<double>(i) + 1);
    ASSERT_GE(late, -1e-9);
    ASSERT_LE(late, 1e-4 + 1e-9);
    if (i > 0) {
      ASSERT_GT(samples[i].t, samples[i - 1].t);
    }
    worst = std::max(worst, late);
    samples[i].displacement = late;
  }
  EXPECT_GT(worst, 0.99e-4);
  EXPECT_NEAR(mean(samples, kStroke), 0.5e-4, 1e-6);
  EXPECT_NEAR(deviation(samples, kStroke), 1e-4 / std::sqrt(12.0), 5e-7);
}

TEST(Sensors, LoseTheStatedShareOfSamples) {
  RigOptions options = quiet();
  options.dropout_fraction = 0.03;
  VirtualRig rig(options, kStart);
  const Samples samples = run(rig, 50.0);
  EXPECT_NEAR(mean(samples, [](const RigSample& s) { return s.dropped ? 1.0 : 0.0; }), 0.03, 3e-3);
}

TEST(Sensors, GainOffsetDelayAndLagActOnTheStroke) {
  const auto stroke = [](std::map<std::string, double> parameters) {
    RigOptions options = quiet();
    parameters["theta1"] = 16.6667;
    options.parameters = parameters;
    VirtualRig rig(options, kStart);
    start(rig, 2.0, 1.0);
    return run(rig, 60.0);
  };
  const Samples plain = stroke({});
  const Samples scaled = stroke({{"sensor_gain", 1.05}, {"sensor_offset", 0.01}});
  const Samples delayed = stroke({{"sensor_delay", 0.0125}});
  const Samples lagged = stroke({{"sensor_lag", 0.02}});
  const auto& p = plain;
  const std::size_t k = 59000;
  EXPECT_NEAR(scaled[k].displacement, 1.05 * p[k].displacement + 0.01, 1e-12);
  EXPECT_NEAR(delayed[k].displacement, 0.5 * (p[k - 12].displacement + p[k - 13].displacement),
              1e-12);
  // A first-order low pass reduces the fundamental by 1/sqrt(1 + (omega tau)^2).
  const auto fundamental = [](const Samples& s) {
    std::complex<double> sum;
    for (std::size_t i = 50000; i < 60000; ++i)
      sum += s[i].displacement * std::polar(1.0, -2 * pi * 2.0 * 1e-3 * static_cast<double>(i));
    return std::abs(sum);
  };
  EXPECT_NEAR(fundamental(lagged) / fundamental(plain), 1 / std::hypot(1.0, 4 * pi * 0.02), 2e-3);
  // The same holds for a lag of one sample: straight lines between samples would take 1.3e-5
  // more.
  const double brief = fundamental(stroke({{"sensor_lag", 1e-3}})) / fundamental(plain);
  EXPECT_NEAR(brief, 1 / std::hypot(1.0, 4 * pi * 1e-3), 1e-7);
}

TEST(Sensors, BendDriftAndGiveAsTold) {
  const auto record = [](const std::map<std::string, double>& parameters) {
    RigOptions options = quiet();
    options.parameters = parameters;
    VirtualRig rig(options, kStart);
    start(rig, 2.0, 1.0);
    return run(rig, 10.0);
  };
  const Samples plain = record({});
  const Samples bent = record({{"sensor_quadratic", 0.1}, {"sensor_drift", 1e-4}});
  const Samples late = record({{"excitation_sensor_gain", 1.1}, {"excitation_sensor_delay", 2e-3}});
  const std::size_t k = 9000;
  const double u = plain[k].displacement;
  EXPECT_NEAR(bent[k].displacement, u + 0.1 * u * u + 1e-4 * 9.001, 1e-12);
  EXPECT_NEAR(late[k].excitation, 1.1 * plain[k - 2].excitation, 1e-12);
  EXPECT_EQ(late[k].displacement, u);

  // The fixture deflects by force / k_n, where the force is the table's minus the inertial
  // part.
  const Samples soft = record({{"series_stiffness", 1e4}});
  const double acceleration =
      (plain[k + 1].displacement - 2 * u + plain[k - 1].displacement) / 1e-6;
  EXPECT_NEAR(soft[k].displacement - u, (plain[k].excitation - acceleration) / 1e4, 1e-8);

  const Samples whole = record({{"excitation_h2", 0.2}});
  const Samples pure = record({{"excitation_h2", 0.2}, {"excitation_unrecorded", 1.0}});
  EXPECT_EQ(whole[k].displacement, pure[k].displacement);
  EXPECT_NEAR(pure[k].excitation, plain[k].excitation, 1e-12);
  EXPECT_GT(std::abs(whole[k].excitation - plain[k].excitation), 0.05);
}

TEST(Faults, OfTheSensor) {
  VirtualRig rig(quiet(), kStart);
  start(rig);
  run(rig, 1.0);
  rig.inject(Fault::sensor_frozen);
  const Samples frozen = run(rig, 2.0);
  ASSERT_EQ(frozen.size(), 1000u);
  for (const auto& s : frozen)
    ASSERT_EQ(s.displacement, frozen[0].displacement);
  EXPECT_GT(deviation(frozen, kTable), 1.0);
  rig.inject(Fault::sensor_nan);
  for (const auto& s : run(rig, 3.0))
    ASSERT_TRUE(std::isnan(s.displacement));
  rig.inject(Fault::sensor_inverted);
  for (const auto& s : run(rig, 4.0))
    ASSERT_LT(s.displacement, -0.1);
  EXPECT_GT(rig.true_stroke(), 0.1);
  rig.inject(Fault::sensor_silent);
  EXPECT_TRUE(run(rig, 5.0).empty());
  rig.inject(Fault::none);
  const Samples well = run(rig, 6.0);
  ASSERT_EQ(well.size(), 1000u);
  EXPECT_GT(deviation(well, kStroke), 1e-3);
}

TEST(Faults, TripStopsAndLatches) {
  VirtualRig rig(quiet(), kStart);
  start(rig);
  run(rig, 1.0);
  rig.inject(Fault::exciter_trip);
  EXPECT_EQ(rig.status().fault, 2u);
  EXPECT_FALSE(rig.status().ready);
  EXPECT_EQ(rig.true_excitation(), 0.0);
  EXPECT_FALSE(rig.set_enable(true));
  rig.clear_fault();
  EXPECT_FALSE(rig.status().running);  // the motion does not restart by itself
  EXPECT_TRUE(rig.set_enable(true));
}

TEST(Faults, DeafSaysThatItRunsAndDoesNotMove) {
  VirtualRig rig(quiet(), kStart);
  rig.inject(Fault::exciter_deaf);
  start(rig);
  const double rest = rig.true_stroke();
  run(rig, 5.0);
  EXPECT_TRUE(rig.status().running);
  EXPECT_EQ(rig.true_excitation(), 0.0);
  EXPECT_NEAR(rig.true_stroke(), rest, 1e-9);
}

TEST(Faults, SilentHearsNothingSoTheDeadManStopsIt) {
  RigOptions options = quiet();
  options.heartbeat_timeout_s = 0.3;
  VirtualRig rig(options, kStart);
  start(rig);
  rig.inject(Fault::exciter_silent);
  for (int i = 1; i <= 5; ++i) {
    run(rig, 0.1 * i);
    rig.heartbeat(static_cast<std::uint32_t>(i));
  }
  EXPECT_EQ(rig.injected(), Fault::exciter_silent);
  EXPECT_EQ(rig.true_excitation(), 0.0);
  EXPECT_EQ(rig.status().fault, 1u);
}

TEST(Faults, BottomingTripsTheController) {
  VirtualRig rig(quiet(), kStart);
  start(rig, 1.0, 45.0);
  run(rig, 5.0);
  EXPECT_EQ(rig.status().fault, 3u);
  EXPECT_FALSE(rig.status().running);
}

TEST(Faults, HaveNamesThatReadBack) {
  for (int i = 0; i < kFaultCount; ++i) {
    const auto fault = static_cast<Fault>(i);
    EXPECT_EQ(fault_from_name(name(fault)), fault);
  }
  EXPECT_FALSE(fault_from_name("sensor_dead"));
}

TEST(Options, AreCheckedWithTheirRange) {
  const auto message = [](const RigOptions& options) -> std::string {
    try {
      VirtualRig rig(options, kStart);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  RigOptions jitter, gain, unknown;
  jitter.jitter_fraction = 1.5;
  EXPECT_THAT(message(jitter), ::testing::HasSubstr("jitter_fraction = 1.5"));
  gain.parameters["sensor_gain"] = 100;
  EXPECT_THAT(message(gain), ::testing::HasSubstr("sensor_gain = 100"));
  unknown.parameters["nonsense"] = 1;
  EXPECT_THAT(message(unknown), ::testing::HasSubstr("no parameter 'nonsense'"));
}

}  // namespace
}  // namespace shaker::sim
