// The checks before motion: the self check and the gentle start.
#include "daemon/safety/self_check.hpp"

#include <gtest/gtest.h>

#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::EngineBench;
using ::testing::HasSubstr;
using testing::last_stop;

class SelfCheck : public ::testing::Test {
 protected:
  // Returns the reason why the campaign ended. The exciter must have got no order.
  std::string failure(EngineBench& bench, double within_s = 6.0) {
    if (!bench.engine.start(bench_campaign()).ok()) return "refused";
    if (!bench.run_until(State::idle, within_s)) return "not failed";
    EXPECT_TRUE(bench.exciter.sets.empty());
    EXPECT_EQ(bench.outlet.closed, 1);
    EXPECT_EQ(bench.outlet.states(), "CHECK IDLE");
    return last_stop(bench);
  }
};

TEST_F(SelfCheck, FindsAnAbsentSensor) {
  EngineBench bench;
  bench.silent = true;
  EXPECT_THAT(failure(bench), HasSubstr("the displacement sensor is silent"));
  EXPECT_EQ(bench.outlet.alarms("check_sensor"), 1);
}

TEST_F(SelfCheck, FindsNotANumber) {
  EngineBench bench;
  bench.nan = true;
  EXPECT_THAT(failure(bench), HasSubstr("not a number"));
}

TEST_F(SelfCheck, FindsAMissingExcitationChannelThatTheRigFileNames) {
  EngineBench bench;
  bench.excitation_silent = true;
  EXPECT_THAT(failure(bench), HasSubstr("the excitation sensor is silent"));
}

// The bench's clock begins in November 2023.
TEST_F(SelfCheck, SaysThatACalibrationIsOverdueAndGoesOn) {
  auto rig = testing::bench_rig();
  for (const auto& [due, alarms] : {std::pair{"2024-11-30", 0}, std::pair{"2023-10-31", 1}}) {
    rig.calibration[protocol::Channel::displacement] = {"LVDT", "L-1", "2022-10-31",
                                                        due,    2e-5,  "m"};
    EngineBench bench(rig);
    ASSERT_TRUE(bench.measuring());
    EXPECT_EQ(bench.outlet.alarms("calibration_overdue"), alarms) << due;
  }
}

TEST_F(SelfCheck, FindsANoisySensor) {
  EngineBench bench;
  bench.noise = 0.004;
  EXPECT_THAT(failure(bench, 24.0), HasSubstr("wait until the damper has come to rest"));
}

// The bench's accelerometer has a noise of 5 mm/s^2, more than a fifth of 20 mm/s^2.
TEST_F(SelfCheck, FindsATableThatIsRestlessForSoSmallAnAmplitude) {
  EngineBench bench;
  auto campaign = bench_campaign();
  campaign.runs.front().amplitude = 0.02;
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  ASSERT_TRUE(bench.run_until(State::idle, 24.0));
  EXPECT_TRUE(bench.exciter.sets.empty());
  EXPECT_THAT(last_stop(bench), HasSubstr("more than 0.004 (20 % of the first run's amplitude)"));
}

TEST_F(SelfCheck, WaitsForADamperThatStillRings) {
  EngineBench bench;
  const double quiet = bench.noise;
  bench.noise = 0.004;
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  bench.run(9.3);
  EXPECT_EQ(bench.engine.state(), State::check);
  bench.noise = quiet;
  EXPECT_TRUE(bench.run_until(State::ramp, 2.5));
}

// 15 samples/s are 30 in each period of 0.5 Hz.
TEST_F(SelfCheck, AsksASlowRunForNoFastSensor) {
  auto rig = testing::bench_rig();
  rig.limits.stale_s = 0.5;
  EngineBench bench(rig);
  bench.run(0.1);
  auto campaign = bench_campaign();
  campaign.runs[0].frequency_hz = 0.5;
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  bench.silent = true;
  for (int i = 0; i < 300 && bench.engine.state() == State::check; ++i) {
    bench.run(0.065);
    const drivers::Sample sample{.t = bench.clock.now(), .value = 0.15 + 1e-5 * (i % 3)};
    bench.engine.on_samples({&sample, 1});
  }
  EXPECT_EQ(bench.engine.state(), State::ramp) << bench.engine.state_document().reason;
}

TEST_F(SelfCheck, FindsASlowSensor) {
  EngineBench bench;
  bench.run(0.1);
  auto campaign = bench_campaign();
  campaign.runs[0].frequency_hz = 4.0;
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  bench.silent = true;  // instead the test feeds 50 samples/s
  for (int i = 0; i < 300 && bench.engine.state() == State::check; ++i) {
    bench.run(0.02);
    const drivers::Sample sample{.t = bench.clock.now(), .value = 0.15 + 1e-5 * (i % 3)};
    bench.engine.on_samples({&sample, 1});
  }
  EXPECT_EQ(bench.engine.state(), State::idle);
  EXPECT_THAT(last_stop(bench), HasSubstr("the fastest run needs 80.0"));
}

TEST_F(SelfCheck, FindsAnExciterThatDoesNotAnswer) {
  EngineBench bench;
  bench.exciter.silent = true;
  EXPECT_THAT(failure(bench), HasSubstr("the exciter does not answer"));
}

TEST_F(SelfCheck, TakesNoAnswerFromBeforeForOne) {
  EngineBench bench;
  bench.run(0.3);
  bench.exciter.silent = true;
  EXPECT_THAT(failure(bench), HasSubstr("the exciter does not answer"));
}

TEST_F(SelfCheck, FindsAnExciterWithAFault) {
  EngineBench bench;
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  bench.exciter.fault = 7;
  ASSERT_TRUE(bench.run_until(State::idle, 6.0));
  EXPECT_THAT(last_stop(bench), HasSubstr("the exciter reports fault 7"));
}

TEST_F(SelfCheck, ReadsTheDrivesOwnDeadManBack) {
  const std::pair<double, const char*> refused[] = {
      {0.0, "goes on when the link is lost (heartbeat timeout 0); set a timeout of at most 1 s"},
      {-1.0, "heartbeat timeout -1"},
      {std::nan(""), "heartbeat timeout nan"},
      {1.01, "goes on for 1.01 s when the link is lost; 1 s is allowed"},
      {60.0, "goes on for 60 s when the link is lost"},
      {0.15, "below twice the heartbeat period of 0.1 s"}};
  for (const auto& [timeout, sentence] : refused) {
    EngineBench bench;
    bench.exciter.heartbeat_timeout_s = timeout;
    EXPECT_THAT(failure(bench), HasSubstr(sentence));
    EXPECT_TRUE(bench.exciter.sets.empty()) << "nothing has moved";
  }
}

TEST_F(SelfCheck, TakesADeadManUpToWhatTheRigFileAllows) {
  for (const double timeout : {0.2, 1.0}) {
    EngineBench bench;
    bench.exciter.heartbeat_timeout_s = timeout;
    ASSERT_TRUE(bench.measuring()) << timeout;
  }
}

TEST_F(SelfCheck, ProvesADeadManThatCannotBeReadBeforeAnythingMoves) {
  EngineBench bench;
  bench.exciter.heartbeat_timeout_s.reset();
  bench.exciter.deadman_s = 0.4;
  ASSERT_TRUE(bench.measuring());
  EXPECT_EQ(bench.exciter.sets.front().amplitude, 0.0);
  EXPECT_EQ(bench.outlet.alarms("deadman_proved"), 1);
  ASSERT_TRUE(bench.engine.deadman_seen());
  EXPECT_NEAR(bench.engine.deadman_seen()->seconds, 0.4, 0.1);
  ASSERT_TRUE(bench.engine.stop("anna"));
  ASSERT_TRUE(bench.run_until(State::idle, 5.0));
  bench.run(2.0);
  ASSERT_TRUE(bench.measuring());
  EXPECT_EQ(bench.outlet.alarms("deadman_proved"), 1);  // once is enough
}

TEST_F(SelfCheck, RefusesADeadManThatCannotBeSeen) {
  for (const double real : {1.5, 1e9}) {
    EngineBench bench;
    bench.exciter.heartbeat_timeout_s.reset();
    bench.exciter.deadman_s = real;
    ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
    ASSERT_TRUE(bench.run_until(State::idle, 6.0));
    EXPECT_THAT(last_stop(bench), HasSubstr("dead-man is not proved: enabled at amplitude zero"));
    for (const auto& s : bench.exciter.sets)
      EXPECT_EQ(s.amplitude, 0.0);
    EXPECT_FALSE(bench.exciter.alive);
    EXPECT_EQ(bench.outlet.alarms("deadman_unproven"), 1);
  }
}

TEST_F(SelfCheck, AsksNoReplayForADeadMan) {
  auto rig = testing::bench_rig();
  rig.exciter.device = config::ReplayExciter{};
  EngineBench bench(rig);
  bench.exciter.heartbeat_timeout_s.reset();
  ASSERT_TRUE(bench.measuring());
  for (const auto& s : bench.exciter.sets)
    EXPECT_GT(s.amplitude, 0.0) << "no proof at amplitude zero";
  EXPECT_EQ(bench.outlet.alarms("deadman_unproven") + bench.outlet.alarms("deadman_proved"), 0);
}

TEST_F(SelfCheck, TakesAnOperatorsProofInMotion) {
  EngineBench bench;
  bench.exciter.heartbeat_timeout_s.reset();
  bench.exciter.deadman_s = 0.6;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.prove_deadman(bench_campaign()));
  ASSERT_TRUE(bench.run_until(State::ramp, 5.0));
  ASSERT_TRUE(bench.run_until(State::idle, 10.0)) << bench.engine.state_document().reason;
  EXPECT_EQ(bench.outlet.alarms("deadman_proved"), 1);
  ASSERT_TRUE(bench.engine.deadman_seen());
  EXPECT_TRUE(bench.engine.deadman_seen()->in_motion);
  EXPECT_NEAR(bench.engine.deadman_seen()->seconds, 0.6, 0.15);
  EXPECT_THAT(last_stop(bench), HasSubstr("success: the exciter's dead-man acts in motion"));
  bench.run(2.0);
  EXPECT_TRUE(bench.measuring());
}

TEST_F(SelfCheck, StopsATableWhoseDeadManDoesNotActInMotion) {
  EngineBench bench;
  bench.exciter.heartbeat_timeout_s.reset();
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.prove_deadman(bench_campaign()));
  ASSERT_TRUE(bench.run_until(State::fault, 10.0));
  EXPECT_EQ(bench.exciter.amplitude(), 0.0);
  EXPECT_THAT(bench.engine.state_document().reason, HasSubstr("the table still moves 1 s after"));
  EXPECT_FALSE(bench.engine.deadman_seen());
}

TEST_F(SelfCheck, TrustsAProofThatWasKept) {
  EngineBench bench;
  bench.exciter.heartbeat_timeout_s.reset();
  bench.engine.trust_deadman({0.5, false});
  ASSERT_TRUE(bench.measuring());
  EXPECT_EQ(bench.outlet.alarms("deadman_proved"), 0);
}

// --- the gentle start

class GentleStart : public ::testing::Test {
 protected:
  std::string failure(EngineBench& bench) {
    bench.run(0.3);
    if (!bench.engine.start(bench_campaign()).ok()) return "refused";
    if (!bench.run_until(State::fault, 20.0)) return "not failed";
    for (const auto& s : bench.exciter.sets)
      EXPECT_LE(s.amplitude, 1.0);  // never the full level
    EXPECT_FALSE(bench.exciter.status().running);
    return last_stop(bench);
  }
};

TEST_F(GentleStart, FindsAWrongPolarity) {
  EngineBench bench;
  bench.polarity = -1.0;
  EXPECT_THAT(failure(bench), HasSubstr("leads the excitation by 144.0 degrees"));
  EXPECT_EQ(bench.outlet.alarms("polarity"), 1);
}

TEST_F(GentleStart, FindsAFrozenSensor) {
  EngineBench bench;
  bench.run(0.2);
  bench.frozen = true;
  EXPECT_THAT(failure(bench), HasSubstr("the table moves and the stroke does not"));
}

TEST_F(GentleStart, FindsASensorThatIsQuietButDead) {
  EngineBench bench;
  bench.gain = 0.0;
  EXPECT_THAT(failure(bench), HasSubstr("the table moves and the stroke does not"));
}

TEST_F(GentleStart, FindsATableThatDoesNotMove) {
  EngineBench bench;
  bench.exciter.moves_part = 0.0;
  EXPECT_THAT(failure(bench), HasSubstr("asked for 1 m/s^2 and the table moves with 0 m/s^2"));
  EXPECT_EQ(bench.outlet.alarms("exciter_no_motion"), 1);
}

TEST(NoCycle, OfATableThatMovesSaysThatTheExcitationCarriesNoPhase) {
  PeriodFigures table;
  table.samples = 20;
  table.fundamental = {0.0, 0.9};
  const auto moving = check_in_motion(nullptr, 1.0, true, table);
  ASSERT_TRUE(moving && moving->fatal);
  EXPECT_EQ(moving->code, "excitation_without_phase");
  EXPECT_THAT(moving->text, HasSubstr("20 samples a period"));
  table.fundamental = {0.0, 0.1};
  const auto still = check_in_motion(nullptr, 1.0, true, table);
  ASSERT_TRUE(still && still->fatal);
  EXPECT_EQ(still->code, "exciter_no_motion");
}

TEST_F(GentleStart, SaysWhenThePolarityCannotBeTold) {
  EngineBench bench;
  bench.lag_turns = 0.002;
  ASSERT_TRUE(bench.measuring());
  EXPECT_EQ(bench.outlet.alarms("polarity_undetermined"), 1);
  EXPECT_THAT(polarity_finding(0.002).text, HasSubstr("lags the excitation by 0.7 degrees"));
  EXPECT_THAT(polarity_finding(0.502).text, HasSubstr("lags the excitation by -179.3 degrees"));
}

// Lags that change from period to period by far more than the noise, on either side of 180 degrees.
// The gentle start cannot tell, and a loose tolerance calls every cycle steady.
TEST_F(GentleStart, LeavesAPolarityOpenThatAWanderingPhaseDoesNotTell) {
  EngineBench bench;
  bench.lag_turns = 0.499;
  auto campaign = bench_campaign(1, 1000);
  campaign.settle_tolerance = 1000.0;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  ASSERT_TRUE(bench.run_until(State::settle));
  for (const double lag : {0.512, 0.516, 0.508, 0.514, 0.518, 0.511, 0.517, 0.509, 0.515}) {
    bench.lag_turns = lag;
    bench.run(0.25);
  }
  EXPECT_EQ(bench.engine.state(), State::measure) << last_stop(bench);
  EXPECT_EQ(bench.outlet.alarms("polarity"), 0);
  bench.lag_turns = 0.516;
  EXPECT_TRUE(bench.run_until(State::fault, 5.0));
  EXPECT_EQ(bench.outlet.alarms("polarity"), 1);
}

TEST(PolarityRule, LagIsRightLeadIsWrongAndTheEndsAreOpen) {
  EXPECT_EQ(polarity(0.1), Polarity::right);
  EXPECT_EQ(polarity(0.4), Polarity::right);  // above the resonance
  EXPECT_EQ(polarity(0.6), Polarity::wrong);
  EXPECT_EQ(polarity(0.9), Polarity::wrong);
  for (const double lag : {0.0, 0.003, 0.497, 0.5, 0.503, 0.998}) {
    EXPECT_EQ(polarity(lag), Polarity::undetermined) << lag;
  }
}

}  // namespace
}  // namespace shaker::daemon
