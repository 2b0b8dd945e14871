// What the engine does when people, devices and the disk do not do what they should.
#include <gtest/gtest.h>

#include "daemon/safety/self_check.hpp"
#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::bench_rig;
using testing::EngineBench;
using ::testing::HasSubstr;

std::string last_stop(const EngineBench& bench) {
  const auto stops = bench.outlet.all<protocol::RunStopDocument>();
  return stops.empty() ? "none" : stops.back().status + ": " + stops.back().reason;
}

// --- what an operator asks

TEST(EngineSafety, SetpointsOutsideTheLimitsAreRefusedByNameValueAndLimit) {
  EngineBench bench;
  bench.run(0.1);
  const auto refusal = [&](auto change) {
    auto campaign = bench_campaign(2);
    change(campaign.runs[1]);
    const auto result = bench.engine.start(campaign);
    return result.ok() ? std::string("accepted") : result.error().what;
  };
  EXPECT_EQ(refusal([](auto& r) { r.frequency_hz = 12; }),
            "run \"r02\": frequency 12 Hz is above the rig's frequency_max_hz of 10 Hz; change the "
            "run or the rig file");
  EXPECT_THAT(refusal([](auto& r) { r.frequency_hz = 0.1; }), HasSubstr("frequency_min_hz of 0.2"));
  EXPECT_THAT(refusal([](auto& r) { r.frequency_hz = std::nan(""); }), HasSubstr("run \"r02\""));
  EXPECT_THAT(refusal([](auto& r) { r.amplitude = 16; }),
              HasSubstr("amplitude 16 m/s^2 is above the rig's excitation_max_m_s2 of 15 m/s^2"));
  EXPECT_THAT(refusal([](auto& r) { r.amplitude = 0; }), HasSubstr("not above 0"));
  EXPECT_THAT(refusal([](auto& r) { r.cycles = 0; }), HasSubstr("cycles 0"));
  EXPECT_EQ(bench.outlet.opened, 0);
  EXPECT_TRUE(bench.exciter.sets.empty());
}

TEST(EngineSafety, LimitsAreLevelsAtArming) {
  EngineBench bench;
  bench.mean = 0.31;
  bench.run(0.1);
  const auto result = bench.engine.start(bench_campaign());
  ASSERT_FALSE(result.ok());
  EXPECT_THAT(result.error().what, HasSubstr("outside 0..0.3 m"));
}

TEST(EngineSafety, ASecondCampaignIsRefusedWhileOneRuns) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  EXPECT_THAT(bench.engine.start(bench_campaign()).error().what, HasSubstr("MEASURE"));
}

TEST(EngineSafety, StopRampsDownFromEveryMovingStateAndTwiceIsNoError) {
  for (const State from : {State::ramp, State::settle, State::measure}) {
    EngineBench bench;
    bench.run(0.3);
    ASSERT_TRUE(bench.engine.start(bench_campaign(1, 1000)).ok());
    ASSERT_TRUE(bench.run_until(from));
    EXPECT_TRUE(bench.engine.stop("anna").ok());
    EXPECT_EQ(bench.engine.state(), State::ramp_down);
    EXPECT_EQ(bench.exciter.sets.back().amplitude, 0.0);
    const auto sets = bench.exciter.sets.size();
    EXPECT_TRUE(bench.engine.stop("anna").ok());
    EXPECT_EQ(bench.exciter.sets.size(), sets);
    ASSERT_TRUE(bench.run_until(State::idle, 3.0));
    EXPECT_EQ(last_stop(bench), "abort: stopped by anna");
    EXPECT_EQ(bench.outlet.all<protocol::RunStopDocument>().size(), 1u);
    EXPECT_FALSE(bench.exciter.alive);
    EXPECT_TRUE(bench.engine.stop("anna").ok());  // and at rest neither
    bench.run(3.0);
    EXPECT_EQ(bench.engine.state(), State::idle);  // motion never resumes by itself
  }
}

TEST(EngineSafety, StopInCheckEndsTheCampaignWithoutMotion) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  EXPECT_TRUE(bench.engine.stop("anna").ok());
  EXPECT_EQ(bench.engine.state(), State::idle);
  EXPECT_EQ(last_stop(bench), "abort: stopped by anna");
  EXPECT_TRUE(bench.exciter.sets.empty());
  EXPECT_EQ(bench.outlet.closed, 1);
}

TEST(EngineSafety, EmergencyStopIsZeroAtOnceFromEveryStateAndLatches) {
  for (const State from :
       {State::idle, State::check, State::ramp, State::settle, State::measure, State::ramp_down}) {
    EngineBench bench;
    bench.run(0.3);
    if (from != State::idle) {
      ASSERT_TRUE(bench.engine.start(bench_campaign(1, 20)).ok());
      ASSERT_TRUE(bench.run_until(from)) << static_cast<int>(from);
    }
    ASSERT_EQ(bench.engine.state(), from);
    const int stops = bench.exciter.stops;
    EXPECT_TRUE(bench.engine.emergency_stop("anna").ok());
    EXPECT_EQ(bench.engine.state(), State::fault);
    EXPECT_EQ(bench.exciter.stops, stops + 1);
    EXPECT_EQ(bench.exciter.amplitude(), 0.0);
    EXPECT_FALSE(bench.exciter.alive);
    EXPECT_EQ(bench.outlet.alarms("emergency_stop"), 1);
    EXPECT_FALSE(bench.engine.start(bench_campaign()).ok());
    bench.run(1.0);
    EXPECT_EQ(bench.engine.state(), State::fault);
    EXPECT_TRUE(bench.engine.acknowledge("anna").ok());
    EXPECT_EQ(bench.engine.state(), State::idle);
    EXPECT_EQ(bench.outlet.closed, bench.outlet.opened);
  }
}

TEST(EngineSafety, ThereIsNothingToAcknowledgeWithoutAFault) {
  EngineBench bench;
  EXPECT_THAT(bench.engine.acknowledge("anna").error().what, HasSubstr("no fault"));
}

TEST(EngineSafety, ALostLeaseRampsDownAndLatchesNothing) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.engine.set_controlled(true);
  EXPECT_TRUE(bench.engine.state_document().controlled);
  bench.engine.lease_lost();
  EXPECT_EQ(bench.engine.state(), State::ramp_down);
  EXPECT_FALSE(bench.engine.state_document().controlled);
  ASSERT_TRUE(bench.run_until(State::idle, 3.0));
  EXPECT_EQ(bench.outlet.alarms("lease_lost"), 1);
  EXPECT_THAT(last_stop(bench), HasSubstr("abort: the controlling client is gone"));
  bench.engine.lease_lost();  // at rest it means nothing
  EXPECT_EQ(bench.engine.state(), State::idle);
}

// --- the self check

class SelfCheck : public ::testing::Test {
 protected:
  // The reason why the campaign ended, and nothing was ordered from the exciter.
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

TEST_F(SelfCheck, FindsANoisySensor) {
  EngineBench bench;
  bench.noise = 0.004;
  EXPECT_THAT(failure(bench, 24.0), HasSubstr("wait until the damper has come to rest"));
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

TEST_F(SelfCheck, FindsASlowSensor) {
  EngineBench bench;
  bench.run(0.1);
  auto campaign = bench_campaign();
  campaign.runs[0].frequency_hz = 4.0;
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  bench.silent = true;  // 50 samples/s instead, fed by hand
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

TEST_F(SelfCheck, FindsAnExciterWithAFault) {
  EngineBench bench;
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  bench.exciter.fault = 7;
  ASSERT_TRUE(bench.run_until(State::idle, 6.0));
  EXPECT_THAT(last_stop(bench), HasSubstr("the exciter reports fault 7"));
}

TEST_F(SelfCheck, ReadsTheDrivesOwnDeadManBack) {
  const std::pair<std::optional<double>, const char*> cases[] = {{std::nullopt, "deadman_unknown"},
                                                                 {0.0, "deadman_off"}};
  for (const auto& [timeout, code] : cases) {
    EngineBench bench;
    bench.exciter.heartbeat_timeout_s = timeout;
    ASSERT_TRUE(bench.measuring());
    EXPECT_EQ(bench.outlet.alarms(code), 1);
  }
  EngineBench bench;
  bench.exciter.heartbeat_timeout_s = 0.15;
  EXPECT_THAT(failure(bench), HasSubstr("below twice the heartbeat period of 0.1 s"));
}

// --- what the first gentle motion shows

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

TEST_F(GentleStart, SaysWhenThePolarityCannotBeTold) {
  EngineBench bench;
  bench.lag_turns = 0.002;
  ASSERT_TRUE(bench.measuring());
  EXPECT_EQ(bench.outlet.alarms("polarity_undetermined"), 1);
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

// --- the exciter in motion

TEST(EngineSafety, AnExciterErrorRampsDownAndLatches) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.engine.on_exciter_error({ErrorKind::timeout, "exciter: no answer in 0.1 s"});
  EXPECT_EQ(bench.engine.state(), State::ramp_down);
  ASSERT_TRUE(bench.run_until(State::fault, 3.0));
  EXPECT_EQ(last_stop(bench), "fail: exciter: no answer in 0.1 s");
}

TEST(EngineSafety, ARefusedRampDownIsAStopAtOnce) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.refuse_next = 1;
  EXPECT_TRUE(bench.engine.stop("anna").ok());
  const int stops = bench.exciter.stops;
  bench.run(0.01);
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_GT(bench.exciter.stops, stops);
  EXPECT_THAT(bench.engine.state_document().reason, HasSubstr("while ramping down"));
}

TEST(EngineSafety, AnUnconfirmedRampDownIsAStopInABoundedTime) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.deaf_to_orders = true;  // takes the order and does not follow
  EXPECT_TRUE(bench.engine.stop("anna").ok());
  const double begin = seconds(bench.clock.now());
  ASSERT_TRUE(bench.run_until(State::fault, 10.0));
  EXPECT_LT(seconds(bench.clock.now()) - begin, 0.5 + 2.0 + 0.1);
  EXPECT_EQ(bench.outlet.alarms("ramp_down_unconfirmed"), 1);
  EXPECT_FALSE(bench.exciter.status().running);
}

TEST(EngineSafety, ASilentExciterIsRampedDownAndThenStopped) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.silent = true;
  ASSERT_TRUE(bench.run_until(State::ramp_down, 1.2));
  ASSERT_TRUE(bench.run_until(State::fault, 4.0));
  EXPECT_EQ(bench.outlet.alarms("exciter_silent"), 1);
  EXPECT_THAT(bench.engine.acknowledge("anna").error().what, HasSubstr("does not answer"));
  bench.exciter.silent = false;
  bench.run(0.2);
  EXPECT_TRUE(bench.engine.acknowledge("anna").ok());
}

TEST(EngineSafety, WhatAnExciterReportedBeforeItsLinkWentIsNotHeldAgainstIt) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.silent = true;
  bench.exciter.errors.push_back({ErrorKind::io, "no connection to the drive"});
  bench.run(0.05);
  ASSERT_TRUE(bench.engine.emergency_stop("anna").ok());
  const std::string why = bench.engine.acknowledge("anna").error().what;
  EXPECT_THAT(why, HasSubstr("no connection to the drive"));
  EXPECT_THAT(why, ::testing::Not(HasSubstr("reports motion")));
}

TEST(EngineSafety, ATripIsAFaultThatLastsUntilTheExciterIsCleared) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.fault = 3;
  ASSERT_TRUE(bench.run_until(State::fault, 0.2));
  EXPECT_EQ(bench.outlet.alarms("exciter_trip"), 1);
  bench.run(0.2);
  EXPECT_THAT(bench.engine.acknowledge("anna").error().what, HasSubstr("reports fault 3"));
  bench.exciter.fault = 0;
  bench.run(0.2);
  EXPECT_TRUE(bench.engine.acknowledge("anna").ok());
}

config::RigConfig rig_with_a_fault_reset() {
  auto rig = bench_rig();
  config::ModbusExciter modbus;
  modbus.registers["fault_reset"] = {};
  rig.exciter.device = modbus;
  return rig;
}

TEST(EngineSafety, AnAcknowledgementClearsTheExcitersFaultWhereItCan) {
  EngineBench bench(rig_with_a_fault_reset());
  ASSERT_TRUE(bench.measuring());
  bench.exciter.fault = 2;
  ASSERT_TRUE(bench.run_until(State::fault, 0.2));
  EXPECT_EQ(bench.exciter.clears, 0) << "only when an operator asks";
  bench.run(0.2);
  ASSERT_TRUE(bench.engine.acknowledge("anna").ok());
  EXPECT_EQ(bench.exciter.clears, 1);
  EXPECT_TRUE(bench.run_until(State::idle, 0.5));
  EXPECT_THAT(bench.engine.state_document().reason, HasSubstr("acknowledged by anna"));
}

TEST(EngineSafety, AFaultThatTheExciterKeepsStaysAFault) {
  EngineBench bench(rig_with_a_fault_reset());
  ASSERT_TRUE(bench.measuring());
  bench.exciter.fault = 2;
  bench.exciter.clearable = false;
  ASSERT_TRUE(bench.run_until(State::fault, 0.2));
  bench.run(0.2);
  ASSERT_TRUE(bench.engine.acknowledge("anna").ok());
  bench.run(3.0);
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.outlet.alarms("fault_stays"), 1);
}

TEST(EngineSafety, AnExciterThatIsNotReadyOrStopsByItselfEndsTheRun) {
  {
    EngineBench bench;
    ASSERT_TRUE(bench.measuring());
    bench.exciter.ready = false;
    ASSERT_TRUE(bench.run_until(State::fault, 3.0));
    EXPECT_EQ(bench.outlet.alarms("exciter_not_ready"), 1);
  }
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.stands = true;
  ASSERT_TRUE(bench.run_until(State::fault, 3.0));
  EXPECT_EQ(bench.outlet.alarms("exciter_stopped"), 1);
}

TEST(EngineSafety, ARampThatNeverArrivesEndsTheRun) {
  EngineBench bench;
  bench.run(0.3);
  bench.exciter.deaf_to_orders = true;
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  ASSERT_TRUE(bench.run_until(State::fault, 10.0));
  EXPECT_EQ(bench.outlet.alarms("exciter_not_reached"), 1);
}

TEST(EngineSafety, AnExciterThatRunsUnaskedIsStoppedAgainAndAgain) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.runs_on = true;
  EXPECT_TRUE(bench.engine.emergency_stop("anna").ok());
  const int stops = bench.exciter.stops;
  bench.run(3.0);
  EXPECT_GE(bench.exciter.stops, stops + 4);
  EXPECT_GE(bench.outlet.alarms("exciter_runs_unasked"), 1);
  EXPECT_THAT(bench.engine.acknowledge("anna").error().what, HasSubstr("still reports motion"));
}

TEST(EngineSafety, AnExciterThatIsAwayAtRestIsSaidOnceAndFaultsNothing) {
  EngineBench bench;
  for (int i = 0; i < 50; ++i) {
    bench.engine.on_exciter_error({ErrorKind::unavailable, "exciter: connection refused"});
    bench.run(0.1);
  }
  EXPECT_EQ(bench.outlet.alarms("exciter_error"), 1);
  EXPECT_EQ(bench.engine.state(), State::idle);
}

// --- sensors in motion

TEST(EngineSafety, AShortOutageCostsCyclesAndNotTheRun) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 40)));
  bench.run(1.0);
  bench.silent = true;
  bench.run(0.03);  // below stale_s
  bench.silent = false;
  ASSERT_TRUE(bench.run_until(State::idle, 40.0));
  EXPECT_EQ(bench.outlet.all<protocol::RunStopDocument>().at(0).status, "success");
  int gaps = 0;
  for (const auto& c : bench.outlet.all<protocol::CycleDocument>()) {
    if (c.why.find("gap of") != std::string::npos) ++gaps;
  }
  EXPECT_GE(gaps, 1);
  EXPECT_LE(gaps, 2);
}

TEST(EngineSafety, NotANumberInMidRunIsAStaleSensor) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.nan = true;
  ASSERT_TRUE(bench.run_until(State::fault, 3.0));
  EXPECT_EQ(bench.outlet.alarms("stale_sensor"), 1);
}

// --- the disk

TEST(EngineSafety, AFullDiskRampsDownAndFailsTheRunWithTheReason) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  const auto accepted = bench.outlet.recorded.size();
  bench.outlet.full = true;
  ASSERT_TRUE(bench.run_until(State::ramp_down, 0.1));
  ASSERT_TRUE(bench.run_until(State::idle, 3.0));
  EXPECT_EQ(last_stop(bench),
            "fail: nothing can be recorded: campaign.db: no space left on device");
  EXPECT_EQ(bench.outlet.alarms("record_failed"), 1);
  EXPECT_LE(bench.estimator.cycles.size(), accepted + 1);
  EXPECT_EQ(bench.engine.start(bench_campaign()).error().what, "disk full");
  EXPECT_EQ(bench.engine.state(), State::idle);
}

// --- recovery, twice in a row

TEST(EngineSafety, RecoversTwiceInARowFromTheSameFault) {
  EngineBench bench;
  bench.run(0.3);
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(bench.engine.start(bench_campaign(1, 1000)).ok()) << round;
    ASSERT_TRUE(bench.run_until(State::measure)) << round;
    bench.silent = true;
    ASSERT_TRUE(bench.run_until(State::fault, 3.0)) << round;
    bench.silent = false;
    bench.run(0.3);
    ASSERT_TRUE(bench.engine.acknowledge("anna").ok()) << round;
  }
  ASSERT_TRUE(bench.engine.start(bench_campaign(1, 3)).ok());
  ASSERT_TRUE(bench.run_until(State::ramp_down));
  ASSERT_TRUE(bench.run_until(State::idle));
  EXPECT_EQ(bench.outlet.all<protocol::RunStopDocument>().back().status, "success");
  EXPECT_EQ(bench.outlet.opened, 3);
  EXPECT_EQ(bench.outlet.closed, 3);
}

}  // namespace
}  // namespace shaker::daemon
