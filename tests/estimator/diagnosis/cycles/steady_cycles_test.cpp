#include "estimator/diagnosis/cycles/steady_cycles.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/internal/cut_campaign.hpp"
#include "estimator/diagnosis/cycles/internal/found_frequency.hpp"

namespace shaker::estimator::diagnosis {
namespace {

struct Shape {
  double frequency = 2.003;
  double seconds = 8.0;
  double rate = 311.0;  // not a whole number of samples in a cycle
  double transient = 0.0;
  double noise = 1e-5;
  double subharmonic = 0.0;
  double drift = 0.0;
};

// Excitation 3 cos(wt + 0.4); displacement 0.15 + 0.01 cos(phase - 0.7) + 0.002 cos(3 phase).
Recording recording(const Shape& s) {
  std::mt19937_64 source(7);
  std::normal_distribution<double> normal;
  Recording r;
  r.name = "r1";
  r.frequency_hz = 2.0;
  r.amplitude = 3.0;
  for (int i = 0; i < static_cast<int>(s.seconds * s.rate); ++i) {
    const double t = i / s.rate;
    const double phase = (2.0 * std::numbers::pi) * s.frequency * t + 0.4;
    r.t.push_back(t);
    r.excitation.push_back(3.0 * std::cos(phase) + 5e-3 * normal(source));
    r.displacement.push_back(0.15 + 0.01 * std::cos(phase - 0.7) + 0.002 * std::cos(3.0 * phase) +
                             s.transient * std::exp(-t) + s.drift * t +
                             s.subharmonic * std::cos(0.5 * phase) + s.noise * normal(source));
  }
  return r;
}

TEST(SteadyCycles, RecoversHarmonicsAgainstTheExcitationsOwnPhase) {
  const auto run = steady_cycles(recording({}));
  ASSERT_TRUE(run) << run.error().what;
  EXPECT_NEAR(run->frequency_hz, 2.003, 2e-5);
  EXPECT_GE(run->cycles(), 13);
  const Eigen::VectorXd mean = run->mean();
  EXPECT_NEAR(mean[0], 0.15, 2e-6);
  EXPECT_NEAR(mean[1], 0.01 * std::cos(0.7), 3e-6);
  EXPECT_NEAR(mean[2], 0.01 * std::sin(0.7), 3e-6);
  EXPECT_NEAR(mean[5], 0.002, 3e-6);
  EXPECT_NEAR(run->mean_driver()[1], 3.0, 1e-3);
  EXPECT_NEAR(run->mean_driver()[2], 0.0, 1e-3);
}

// A wrong frequency is answered with the right one; a missing one is found.
TEST(SteadyCycles, FindsTheFrequencyAndComparesItWithWhatWasSaid) {
  Recording r = recording({.seconds = 20.0});
  for (const double said : {1.0, 1.5, 1.9, 1.97, 2.05, 2.3, 4.006, 6.0}) {
    r.frequency_hz = said;
    const auto run = steady_cycles(r);
    ASSERT_TRUE(run) << said << run.error().what;
    EXPECT_NEAR(run->frequency_hz, 2.003, 2e-5) << said;
    EXPECT_THAT(run->warnings,
                ::testing::Contains(::testing::HasSubstr(
                    fmt::format("frequency_hz says {:g}, but the excitation has 2.003 Hz", said))));
  }
  for (const double said : {1.999, 2.0}) {  // as a table is set
    r.frequency_hz = said;
    EXPECT_THAT(steady_cycles(r).value().warnings, ::testing::IsEmpty()) << said;
  }
  r.frequency_hz = 0.0;
  EXPECT_THAT(steady_cycles(r).value().warnings,
              ::testing::ElementsAre(::testing::HasSubstr("the excitation has 2.003 Hz")));
  r.frequency_hz = 2003.0;  // time in ms
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("check the unit of its time, or say 2.003"));
}

TEST(SteadyCycles, SaysHowManyCyclesThereAreAndAreNeeded) {
  const auto run = steady_cycles(recording({.seconds = 0.7}));
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().what,
            "run r1: 1.4 cycles at 2 Hz; at least 3 are needed: record the run for longer");
  Recording unsteady = recording({.seconds = 4.0});
  for (std::size_t i = 0; i < unsteady.t.size(); ++i)
    unsteady.excitation[i] = std::fmod(std::exp(2.0 * unsteady.t[i]), 1.0);
  EXPECT_THAT(steady_cycles(unsteady).error().what,
              ::testing::HasSubstr("no steady excitation near 2 Hz was found"));
  unsteady.frequency_hz = 0.0;
  EXPECT_THAT(steady_cycles(unsteady).error().what,
              ::testing::HasSubstr("no steady excitation was found"));
}

TEST(FoundFrequency, IsOfOneLineOnly) {
  const Recording r = recording({});
  EXPECT_NEAR(found_frequency(r.t, r.displacement).value(), 2.003, 2e-3);
  std::mt19937_64 source(7);
  std::normal_distribution<double> normal;
  std::vector<double> noise;
  for (std::size_t i = 0; i < r.t.size(); ++i)
    noise.push_back(normal(source));
  EXPECT_FALSE(found_frequency(r.t, noise));
  EXPECT_FALSE(found_frequency({}, {}));
  EXPECT_FALSE(found_frequency(r.t, std::vector<double>(r.t.size(), 1.0)));
}

// The end of a ramp has nearly the full amplitude, but another phase.
TEST(SteadyCycles, IsNotTurnedByTheEndOfARamp) {
  Recording r = recording({.seconds = 9.0});
  for (std::size_t i = 0; i < r.t.size() && r.t[i] < 0.5; ++i)
    r.excitation[i] += 0.03 * std::sin((2.0 * std::numbers::pi) * 2.003 * r.t[i] + 0.4);
  const auto run = steady_cycles(r);
  ASSERT_TRUE(run) << run.error().what;
  EXPECT_NEAR(run->frequency_hz, 2.003, 1e-5);
  EXPECT_NEAR(run->mean_driver()[2], 0.0, 1e-3);
}

TEST(SteadyCycles, DropsTheTransientAndKeepsTheRest) {
  const auto run = steady_cycles(recording({.seconds = 15.0, .transient = 1e-3}));
  ASSERT_TRUE(run) << run.error().what;
  // exp(-t) falls below the noise of a cycle's mean, 1e-5 / sqrt(155), after seven seconds.
  EXPECT_GT(run->cycles_dropped, 8);
  EXPECT_GT(run->cycles(), 8);
  EXPECT_NEAR(run->mean()[0], 0.15, 2e-6);
}

TEST(SteadyCycles, SaysWhenTheCyclesDrift) {
  const auto run = steady_cycles(recording({.drift = 2e-5}));
  ASSERT_TRUE(run) << run.error().what;
  EXPECT_TRUE(run->drifting);
}

TEST(SteadyCycles, SeesAResponseThatRepeatsEverySecondCycleOnly) {
  for (const double size : {1e-3, 1e-4, 1e-5}) {
    for (const double seconds : {4.0, 8.0, 30.0}) {
      const auto run = steady_cycles(recording({.seconds = seconds, .subharmonic = size}));
      ASSERT_TRUE(run) << run.error().what;
      EXPECT_EQ(run->subharmonic, 2) << size << " for " << seconds;
    }
  }
}

// A mode near half the driving frequency, which decays by a factor of 0.3 in each cycle.
TEST(SteadyCycles, DoesNotTakeADyingAlternationForASubharmonic) {
  for (const double beside : {0.0, 0.03}) {
    Recording r = recording({});
    for (std::size_t i = 0; i < r.t.size(); ++i)
      r.displacement[i] += 5e-4 * std::exp(-0.6 * r.t[i]) *
                           std::cos((2.0 * std::numbers::pi) * (1.0 + beside) * r.t[i]);
    const auto run = steady_cycles(r);
    ASSERT_TRUE(run) << run.error().what;
    EXPECT_EQ(run->subharmonic, 0) << beside;
    EXPECT_TRUE(run->drifting) << beside;
  }
}

TEST(SteadyCycles, NeedsThreeCycles) {
  const auto run = steady_cycles(recording({.seconds = 1.4}));
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("run r1"));
}

TEST(SteadyCycles, RefusesAnExcitationThatNeverChanges) {
  Recording r = recording({});
  std::fill(r.excitation.begin(), r.excitation.end(), 0.1);
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("never changes"));
}

TEST(SteadyCycles, RefusesChannelsThatAreNotOnOneClock) {
  Recording r = recording({});
  r.excitation.pop_back();
  EXPECT_THAT(steady_cycles(r).error().what, ::testing::HasSubstr("one clock"));
  r = recording({});
  r.t[100] = r.t[99];
  EXPECT_THAT(steady_cycles(r).error().what, ::testing::HasSubstr("does not increase"));
}

TEST(SteadyCycles, RefusesAClippedSensor) {
  Recording r = recording({});
  for (double& u : r.displacement)
    u = std::min(u, 0.157);
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("clipped"));
}

// The clipping takes off a fortieth of the stroke.
TEST(SteadyCycles, RefusesASensorThatIsClippedForAFewSamplesACycle) {
  for (const double rate : {100.15, 103.0, 311.0}) {
    Recording r = recording({.rate = rate});
    for (double& u : r.displacement)
      u = std::min(1e-6 * std::round(u * 1e6), 0.16);
    const auto run = steady_cycles(r);
    ASSERT_FALSE(run) << rate;
    EXPECT_THAT(run.error().what, ::testing::HasSubstr("stays on its highest value")) << rate;
  }
}

// The stroke comes to rest with zero slope and starts again with zero slope.
TEST(SteadyCycles, DoesNotTakeADamperThatSticksForAClippedSensor) {
  for (const double step : {1e-6, 1e-4, 1e-3}) {
    Recording r = recording({.rate = 101.7});
    for (std::size_t i = 0; i < r.t.size(); ++i) {
      const double turn = std::fmod(2.003 * r.t[i], 1.0);
      const double part = std::fmod(turn, 0.5) / 0.44;  // it moves for 44 % of each half
      const double way =
          part < 1.0 ? 0.5 - 0.5 * std::cos(0.5 * (2.0 * std::numbers::pi) * part) : 1.0;
      r.displacement[i] = 0.15 + 0.01 * (turn < 0.5 ? way : 1.0 - way);
      r.displacement[i] = step * std::round(r.displacement[i] / step);
    }
    const auto run = steady_cycles(r);
    EXPECT_TRUE(run) << step << ": " << run.error().what;
  }
}

TEST(SteadyCycles, DoesWithoutAChannelThatIsClippedOrDead) {
  Recording r = recording({});
  for (std::size_t i = 0; i < r.t.size(); ++i) {
    r.force.push_back(std::max(-7.0, r.displacement[i] * -1e3 + 150.0));
    r.acceleration.push_back(0.0);
  }
  const auto run = steady_cycles(r);
  ASSERT_TRUE(run) << run.error().what;
  EXPECT_EQ(run->force.rows(), 0);
  EXPECT_EQ(run->acceleration.rows(), 0);
  ASSERT_EQ(run->warnings.size(), 2u);
  EXPECT_THAT(run->warnings[0], ::testing::HasSubstr("the acceleration never changes"));
  EXPECT_THAT(run->warnings[1], ::testing::HasSubstr("the force stays on its lowest value"));
}

TEST(SteadyCycles, RefusesASensorThatIsAtItsEndAllTheTime) {
  Recording r = recording({});
  for (std::size_t i = 200; i < r.displacement.size(); ++i)  // after one cycle
    r.displacement[i] = 0.13;
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("clipped"));
}

TEST(SteadyCycles, RefusesAClippedAccelerometer) {
  Recording r = recording({});
  for (double& x : r.excitation)
    x = std::min(x, 2.4);
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("the excitation stays on its highest value"));
}

TEST(SteadyCycles, RefusesADisplacementWhoseClockRunsFast) {
  Recording r = recording({});
  const Recording fast = recording({.frequency = 2.003 * 1.004});
  r.displacement = fast.displacement;
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what,
              ::testing::HasSubstr("slips by 1.4 degrees against the excitation"));
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("not on one clock (0.4 % apart)"));
}

TEST(SteadyCycles, RefusesAnExcitationThatGrows) {
  Recording r = recording({});
  for (std::size_t i = 0; i < r.t.size(); ++i)
    r.excitation[i] *= 1.0 + 0.02 * r.t[i];
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("the excitation is not steady"));
}

TEST(SteadyCycles, NamesASampleThatStandsAlone) {
  Recording r = recording({});
  r.displacement[2000] += 2e-3;
  r.excitation[1500] = 0.0;
  const auto run = steady_cycles(r);
  ASSERT_TRUE(run) << run.error().what;
  ASSERT_EQ(run->warnings.size(), 2u);
  EXPECT_THAT(run->warnings[0], ::testing::HasSubstr("the displacement is 0.1"));
  EXPECT_THAT(run->warnings[0], ::testing::HasSubstr("at t = 6.43087 s"));
  EXPECT_THAT(run->warnings[1], ::testing::HasSubstr("the excitation is 0 at t = 4.82315 s"));
}

// A force that jumps at every velocity reversal has samples far from their neighbours in each
// cycle.
TEST(SteadyCycles, HasNoSpikesInAForceThatJumps) {
  Recording r = recording({});
  for (std::size_t i = 0; i < r.t.size(); ++i)
    r.displacement[i] += std::sin((2.0 * std::numbers::pi) * 2.003 * r.t[i]) > 0.0 ? 0.004 : -0.004;
  const auto run = steady_cycles(r);
  ASSERT_TRUE(run) << run.error().what;
  EXPECT_THAT(run->warnings, ::testing::Not(::testing::Contains(::testing::HasSubstr("alone"))));
}

TEST(CutCampaign, SaysNothingOfACampaignWhoseRunsMostlySlip) {
  Campaign campaign;
  for (int i = 0; i < 3; ++i) {
    Recording r = recording({});
    r.name = "r" + std::to_string(i);
    if (i < 2) r.displacement = recording({.frequency = 2.003 * 1.004}).displacement;
    campaign.runs.push_back(r);
  }
  std::vector<std::string> warnings;
  const auto runs = cut_campaign(campaign, {}, warnings);
  ASSERT_FALSE(runs);
  EXPECT_THAT(runs.error().what, ::testing::HasSubstr("2 of 3 runs slip"));
}

TEST(SteadyCycles, SaysThatTheAmplitudeIsNotTheOneThatWasSet) {
  Recording r = recording({});
  r.amplitude = 9.0;
  const auto run = steady_cycles(r);
  ASSERT_TRUE(run) << run.error().what;
  ASSERT_EQ(run->warnings.size(), 1u);
  EXPECT_THAT(run->warnings[0], ::testing::HasSubstr("an amplitude of 3, the campaign says 9"));
}

TEST(SteadyCycles, TakesCoarseQuantisationForWhatItIs) {
  Recording r = recording({});
  for (double& u : r.displacement)
    u = 5e-5 * std::round(u / 5e-5);
  EXPECT_TRUE(steady_cycles(r));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
