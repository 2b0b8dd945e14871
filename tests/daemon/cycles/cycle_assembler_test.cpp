#include "daemon/cycles/cycle_assembler.hpp"

#include <chrono>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "support/exact_oleo.hpp"
#include "support/sample_stream.hpp"

namespace shaker::daemon {
namespace {

using protocol::Channel;
using testing::ExactOleo;
using testing::SampleStream;
using testing::StreamOptions;

struct Errors {
  std::vector<AssembledCycle> cycles;
  double frequency_ppm = 0.0;  // of the last cycle
  double point_rms = 0.0;  // of the mean of all whole cycles after the fourth, against the truth, m
  double scatter = 0.0;    // of the points about that mean
  double excitation = 0.0;  // largest, m/s^2
  long rejected = 0;
};

Errors assemble(const ExactOleo& oleo, const StreamOptions& options, int wanted, int points = 64,
                bool excitation_measured = true) {
  SampleStream stream(
      options, [&](double tau) { return oleo.stroke(tau); },
      [&](double tau) { return oleo.excitation(tau); });
  CycleAssembler assembler;
  assembler.restart({.points = points,
                     .nominal_hz = options.frequency_hz,
                     .sample_rate_hz = options.rate_hz,
                     .excitation_measured = excitation_measured},
                    Nanoseconds{0});
  Errors result;
  stream.run_to((wanted + 3) / options.frequency_hz, [&](Nanoseconds t, double u, double x) {
    assembler.push(Channel::displacement, t, u);
    assembler.push(Channel::excitation, t, x);
    while (const auto* cycle = assembler.poll()) {
      cycle->whole ? result.cycles.push_back(*cycle) : void(++result.rejected);
    }
  });
  if (result.cycles.size() < 6) return result;
  std::vector<double> mean(static_cast<std::size_t>(points), 0.0);
  const double count = static_cast<double>(result.cycles.size() - 4);
  for (std::size_t k = 4; k < result.cycles.size(); ++k) {
    for (std::size_t i = 0; i < mean.size(); ++i) {
      mean[i] += result.cycles[k].measured.displacement[i] / count;
    }
  }
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const double tau = static_cast<double>(i) / points;
    result.point_rms += std::pow(mean[i] - oleo.stroke(tau), 2) / points;
    for (std::size_t k = 4; k < result.cycles.size(); ++k) {
      const auto& m = result.cycles[k].measured;
      result.scatter += std::pow(m.displacement[i] - mean[i], 2) / points / (count - 1);
      if (!m.excitation.empty()) {
        result.excitation =
            std::max(result.excitation, std::abs(m.excitation[i] - oleo.excitation(tau)));
      }
    }
  }
  result.point_rms = std::sqrt(result.point_rms);
  result.scatter = std::sqrt(result.scatter);
  const auto& last = result.cycles.back().measured;
  result.frequency_ppm = 1e6 * (last.frequency_hz / stream.true_frequency() - 1.0);
  return result;
}

class CycleAssemblerTest : public ::testing::Test {
 protected:
  static const ExactOleo& oleo() {
    static const ExactOleo exact(2.0, 3.048);
    return exact;
  }
};

TEST_F(CycleAssemblerTest, TheReferenceRepeatsAndHasItsPublishedValue) {
  EXPECT_LT(oleo().closure(), 1e-12);
  EXPECT_NEAR(oleo().stroke(0.0), 0.17366052, 2e-7);
}

TEST_F(CycleAssemblerTest, CleanSamplesGiveTheExactCycleToAFifthOfAMicrometre) {
  const auto e = assemble(oleo(), {.clock_ppm = 200.0, .phase_turns = 0.37}, 20);
  ASSERT_GE(e.cycles.size(), 18u);
  EXPECT_EQ(e.rejected, 0);
  EXPECT_LT(e.point_rms, 2e-7);
  EXPECT_LT(std::abs(e.frequency_ppm), 0.5);  // error of the first period's fit, 200 ppm off
  EXPECT_LT(e.excitation, 2e-5);
}

// 200 ppm, 10 % jitter, 1 % losses, and the noise of the rig. The average over 30 cycles
// reduces the noise of a point to 30^-0.5 of it; the rest is the error of the method.
TEST_F(CycleAssemblerTest, WanderingStampsLossesAndNoiseLeaveErrorsFarBelowTheNoise) {
  StreamOptions o{.clock_ppm = 200.0, .phase_turns = 0.2, .jitter = 0.1, .dropout = 0.01};
  auto quiet = assemble(oleo(), o, 34);
  EXPECT_EQ(quiet.rejected, 0);
  EXPECT_LT(quiet.point_rms, 1e-6);
  EXPECT_LT(quiet.scatter, 2e-6);
  EXPECT_LT(std::abs(quiet.frequency_ppm), 1.0);
  EXPECT_NEAR(quiet.cycles.back().jitter_fraction, 0.1 / std::sqrt(3.0), 0.01);

  o.noise_m = 2e-5;
  o.noise_m_s2 = 5e-3;
  auto noisy = assemble(oleo(), o, 34);
  EXPECT_LT(std::abs(noisy.frequency_ppm), 5.0);
  EXPECT_LT(noisy.excitation, 3e-3);
  double amplitude = 0.0;  // its scatter must be excitation_error: 5e-3 sqrt(2 / 495)
  for (const auto& c : noisy.cycles) {
    amplitude +=
        std::pow(c.measured.amplitude - 3.048, 2) / static_cast<double>(noisy.cycles.size());
  }
  EXPECT_NEAR(noisy.cycles.back().measured.excitation_error, 5e-3 * std::sqrt(2.0 / 495.0), 3e-5);
  EXPECT_NEAR(std::sqrt(amplitude) / noisy.cycles.back().measured.excitation_error, 1.0, 0.35);
  const double point = noisy.cycles.back().point_noise;
  EXPECT_NEAR(noisy.cycles.back().sample_noise, 2e-5, 2e-6);
  EXPECT_NEAR(noisy.scatter / point, 1.0, 0.1);
  EXPECT_LT(noisy.point_rms, 1.3 * point / std::sqrt(30.0));
}

TEST_F(CycleAssemblerTest, ASamplingThatWandersWithTrueStampsIsNotSmoothed) {
  const auto e = assemble(
      oleo(), {.clock_ppm = 200.0, .jitter = 0.1, .stamps_wander = false, .dropout = 0.01}, 20);
  EXPECT_EQ(e.rejected, 0);
  EXPECT_LT(e.point_rms, 1e-7);
  EXPECT_LT(e.scatter, 1e-7);
}

// The phase of the fundamental of equally spaced points, rad.
double phase_of(const std::vector<double>& points) {
  std::complex<double> c = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
    c += points[i] * std::polar(1.0, -2.0 * std::numbers::pi * static_cast<double>(i) /
                                         static_cast<double>(points.size()));
  return std::arg(c);
}

// A clock that is tracked through a device's answers drifts like this when the PC of the rig is
// busy. A line through the phases of 32 cycles follows it too late, by up to 6e-4 rad.
TEST_F(CycleAssemblerTest, AClockThatWandersLeavesTheStrokeInPhaseWithItsExcitation) {
  const auto e = assemble(oleo(), {.drift_s = 1e-4}, 60);
  ASSERT_GE(e.cycles.size(), 58u);
  std::vector<double> exact;
  for (int i = 0; i < 64; ++i)
    exact.push_back(oleo().stroke(i / 64.0));
  double excitation = 0.0;
  for (std::size_t k = 4; k < e.cycles.size(); ++k) {
    const auto& m = e.cycles[k].measured;
    const double lag = phase_of(m.displacement) - phase_of(m.excitation);
    EXPECT_NEAR(lag, phase_of(exact), 7e-5) << k;
    excitation = std::max(excitation, std::abs(phase_of(m.excitation)));
  }
  EXPECT_GT(excitation, 5e-4) << "the line did come late";
}

TEST_F(CycleAssemblerTest, ASlowSensorIsInterpolatedWithoutALag) {
  const auto e = assemble(oleo(), {.rate_hz = 100.0, .clock_ppm = 200.0}, 20);
  EXPECT_EQ(e.rejected, 0);
  EXPECT_LT(e.point_rms, 1e-5);
}

TEST_F(CycleAssemblerTest, WithoutAnExcitationChannelTheFrequencyComesFromTheStroke) {
  const auto e = assemble(oleo(), {.clock_ppm = 200.0}, 34, 64, false);
  ASSERT_GE(e.cycles.size(), 30u);
  EXPECT_LT(std::abs(e.frequency_ppm), 1e-2);
  EXPECT_TRUE(e.cycles.back().measured.excitation.empty());
  EXPECT_EQ(e.cycles.back().measured.amplitude, 0.0) << "nobody measured it";
  // The command's phase is tau = 0 at t = 0; the error is at most 200 ppm of one period.
  EXPECT_LT(e.point_rms, 1e-4);
}

TEST_F(CycleAssemblerTest, TheStrokeLagsWhereADamperTakesPower) {
  const auto e = assemble(oleo(), {}, 8);
  EXPECT_GT(e.cycles.back().lag_turns, 0.02);
  EXPECT_LT(e.cycles.back().lag_turns, 0.48);
}

TEST_F(CycleAssemblerTest, ALongGapRejectsItsCycleWithTheReasonAndOnlyThat) {
  SampleStream stream(
      {}, [&](double tau) { return oleo().stroke(tau); },
      [&](double tau) { return oleo().excitation(tau); });
  CycleAssembler assembler;
  assembler.restart({.nominal_hz = 2.0}, Nanoseconds{0});
  std::vector<std::string> why;
  stream.run_to(5.0, [&](Nanoseconds t, double u, double x) {
    const double s = seconds(t);
    if (s < 2.2 || s > 2.2125) assembler.push(Channel::displacement, t, u);
    assembler.push(Channel::excitation, t, x);
    while (const auto* cycle = assembler.poll()) {
      if (!cycle->whole) why.push_back(cycle->why);
    }
  });
  ASSERT_EQ(why.size(), 1u);
  EXPECT_EQ(why[0], "gap of 14.0 ms; up to 7.8 ms is allowed");
}

TEST_F(CycleAssemblerTest, EightChannelsOfTenKilohertzCostLittle) {
  // Only the two used channels are pushed; the others never reach the assembler.
  SampleStream stream(
      {.rate_hz = 10'000.0, .jitter = 0.1, .noise_m = 2e-5, .noise_m_s2 = 5e-3},
      [&](double tau) { return oleo().stroke(tau); },
      [&](double tau) { return oleo().excitation(tau); });
  CycleAssembler assembler;
  assembler.restart({.nominal_hz = 2.0, .sample_rate_hz = 10'000.0}, Nanoseconds{0});
  struct Raw {
    Nanoseconds t;
    double u, x;
  };
  std::vector<Raw> raw;
  stream.run_to(10.0, [&](Nanoseconds t, double u, double x) { raw.push_back({t, u, x}); });
  const auto begin = std::chrono::steady_clock::now();
  int cycles = 0;
  for (const auto& r : raw) {
    assembler.push(Channel::displacement, r.t, r.u);
    assembler.push(Channel::excitation, r.t, r.x);
    while (assembler.poll() != nullptr)
      ++cycles;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(cycles, 17);
  RecordProperty("percent_of_one_core", std::to_string(100.0 * took.count() / 10.0));
  std::printf("10 kHz: %.2f %% of one core, %.0f us per cycle\n", 10.0 * took.count(),
              1e6 * took.count() / cycles);
  EXPECT_LT(took.count(), 2.0);  // a fifth of real time, even under a sanitizer
}

// The last point needs four samples after it; the estimate waits for no more.
TEST_F(CycleAssemblerTest, OfASlowSensorGivesACycleFourSamplesAfterItsLastPoint) {
  SampleStream stream(
      {.rate_hz = 100.0}, [](double tau) { return oleo().stroke(tau); },
      [](double tau) { return oleo().excitation(tau); });
  CycleAssembler assembler;
  assembler.restart(
      {.points = 64, .nominal_hz = 2.0, .sample_rate_hz = 100.0, .excitation_measured = true},
      Nanoseconds{0});
  int cycles = 0;
  stream.run_to(10.0, [&](Nanoseconds t, double u, double x) {
    assembler.push(Channel::displacement, t, u);
    assembler.push(Channel::excitation, t, x);
    while (const auto* cycle = assembler.poll()) {
      const double samples_after = seconds(t - cycle->begin) * 100.0 - 50.0 * 63.0 / 64.0;
      EXPECT_GE(samples_after, 4.0);
      EXPECT_LE(samples_after, 5.6);
      ++cycles;
    }
  });
  EXPECT_GE(cycles, 15);
}

}  // namespace
}  // namespace shaker::daemon
