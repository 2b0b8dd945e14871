// Forces that jump, sampled at the same few phases of every cycle: a round rate over a round frequency.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kRate = 500.0;

// `every_second`: by which the force is larger in every second cycle.
Recording friction(double frequency_hz, double amplitude, std::uint64_t seed,
                   double every_second = 0.0) {
  constexpr double kCycles = 16.0, kNoise = 0.02;
  std::mt19937_64 source(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  Recording run;
  run.name = "r" + std::to_string(seed);
  run.kind = Kind::imposed_motion;
  run.frequency_hz = frequency_hz;
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const double phase = std::uniform_real_distribution<double>(0.0, 1.0)(source);
  for (int i = 0; i < static_cast<int>(kCycles * kRate / frequency_hz); ++i) {
    const double t = i / kRate, turns = frequency_hz * t + phase;
    const double u = amplitude * std::cos(2.0 * std::numbers::pi * turns);
    const double v = -amplitude * omega * std::sin(2.0 * std::numbers::pi * turns);
    const bool second = static_cast<int>(turns) % 2 == 1;
    const double force = 20.0 * v + 40.0 * u + 6.0 * std::copysign(1.0, v);
    run.t.push_back(t);
    run.displacement.push_back(u);
    run.force.push_back(force * (second ? 1.0 + every_second : 1.0) + noise(source));
  }
  return run;
}

class SampledJumps : public ::testing::TestWithParam<std::vector<double>> {};

TEST_P(SampledJumps, AreNoSubharmonicAndLeaveTheRightName) {
  Campaign campaign;
  std::uint64_t seed = 1;
  for (const double frequency : GetParam()) {
    campaign.runs.push_back(friction(frequency, 0.02, seed));
    campaign.runs.push_back(friction(frequency, 0.03, seed + 1));
    seed += 2;
  }
  const auto d = diagnose(campaign, estimator::testing::linear_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_THAT(d->warnings, Not(Contains(HasSubstr("subharmonic"))));
  EXPECT_THAT(d->warnings, Not(Contains(HasSubstr("left out"))));
  EXPECT_THAT(d->warnings, Not(Contains(HasSubstr("still drift"))));
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "coulomb_friction");
  for (const ParameterEstimate& p : d->effects[0].parameters) {
    if (p.name == "f_c") {
      EXPECT_NEAR(p.value, 6.0, 4.0 * p.standard_error);
    }
  }
}

// A cycle has a whole number of samples; three, or two, cycles have; nearly; none.
INSTANTIATE_TEST_SUITE_P(Rates, SampledJumps,
                         ::testing::Values(std::vector{1.0, 2.0, 4.0}, std::vector{1.5, 3.0, 6.0},
                                           std::vector{0.8, 1.6, 3.2}, std::vector{1.002, 2.999},
                                           std::vector{1.013, 2.171, 4.397}));

TEST(SampledJumps, DoNotHideAForceThatRepeatsEverySecondCycle) {
  for (const double frequency : {2.0, 4.0}) {
    const auto run = steady_cycles(friction(frequency, 0.03, 7, 0.02));
    ASSERT_TRUE(run) << run.error().what;
    EXPECT_EQ(run->subharmonic, 2) << frequency;
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
