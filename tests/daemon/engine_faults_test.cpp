// The engine's reaction to faults of the exciter, a sensor or the disk.
#include <gtest/gtest.h>

#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::bench_rig;
using testing::EngineBench;
using ::testing::HasSubstr;
using testing::last_stop;

// --- the exciter in motion

TEST(EngineFaults, AnExciterErrorRampsDownAndLatches) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.engine.on_exciter_error({ErrorKind::unavailable, "exciter: no answer in 0.1 s"});
  EXPECT_EQ(bench.engine.state(), State::ramp_down);
  ASSERT_TRUE(bench.run_until(State::fault, 3.0));
  EXPECT_EQ(last_stop(bench), "fail: exciter: no answer in 0.1 s");
}

TEST(EngineFaults, ThreeMissedAnswersInARowEndTheRunAndFewerDoNot) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  const Error missed{ErrorKind::timeout, "exciter: no answer in 0.1 s"};
  for (int i = 0; i < 10; ++i) {
    bench.engine.on_exciter_error(missed);
    bench.engine.on_exciter_error(missed);
    bench.run(0.2);
    ASSERT_EQ(bench.engine.state(), State::measure);
  }
  for (int i = 0; i < 3; ++i)
    bench.engine.on_exciter_error(missed);
  EXPECT_EQ(bench.engine.state(), State::ramp_down);
  EXPECT_EQ(bench.outlet.alarms("exciter_error"), 1);
}

TEST(EngineFaults, AHeartbeatThatCameTooLateIsTheFaultAndNotWhatTheTableThenShows) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.engine.on_late_heartbeat(0.5);
  EXPECT_EQ(bench.engine.state(), State::measure) << "the dead-man takes 0.5 s";
  bench.engine.on_late_heartbeat(0.51);
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.outlet.alarms("heartbeat_late"), 1);
  bench.run(1.0);
  EXPECT_EQ(bench.outlet.alarms("command_error"), 0);
  bench.engine.on_late_heartbeat(9.0);
  EXPECT_EQ(bench.outlet.alarms("heartbeat_late"), 1) << "nothing moves";
}

TEST(EngineFaults, AProgramThatStoodStillInTheSelfCheckMovesNothing) {
  EngineBench bench;
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  bench.run(0.3);
  ASSERT_EQ(bench.engine.state(), State::check);
  bench.clock.advance(std::chrono::milliseconds(400));
  bench.run(0.1);
  ASSERT_EQ(bench.engine.state(), State::check) << "the dead-man takes 0.5 s";
  bench.clock.advance(std::chrono::milliseconds(510));
  bench.run(5.0);
  EXPECT_EQ(bench.engine.state(), State::idle);
  EXPECT_EQ(bench.outlet.alarms("stood_still"), 1);
  EXPECT_THAT(last_stop(bench), HasSubstr("longer than the exciter's dead-man of 0.5 s"));
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  EXPECT_TRUE(bench.run_until(State::measure));
}

TEST(EngineFaults, ADriveThatHasStoppedIsTheFaultAndNotTheTableThatRestsThen) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.fault = 2;
  bench.exciter.moves_part = 0.0;
  bench.exciter.silent = true;
  bench.run(0.8);  // more than two periods: the table is seen to rest
  EXPECT_EQ(bench.outlet.alarms("command_error"), 0) << "the drive has not reported yet";
  bench.exciter.silent = false;
  ASSERT_TRUE(bench.run_until(State::fault, 0.2));
  EXPECT_EQ(bench.outlet.alarms("exciter_trip"), 1);
  EXPECT_EQ(bench.outlet.alarms("command_error"), 0);
}

TEST(EngineFaults, ATableThatRestsIsTheFaultWhereTheDriveReportsNothing) {
  EngineBench bench;
  auto campaign = bench_campaign(1, 1000);
  campaign.runs[0].frequency_hz = 10.0;
  ASSERT_TRUE(bench.measuring(campaign));
  bench.exciter.moves_part = 0.0;
  bench.exciter.silent = true;
  bench.run(0.4);
  EXPECT_EQ(bench.outlet.alarms("command_error"), 0);
  bench.run(0.5);
  EXPECT_EQ(bench.outlet.alarms("command_error"), 1);
}

TEST(EngineFaults, ARefusedRampDownIsAStopAtOnce) {
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

TEST(EngineFaults, AnUnconfirmedRampDownIsAStopInABoundedTime) {
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

TEST(EngineFaults, ASilentExciterIsRampedDownAndThenStopped) {
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

// The limit belongs to the time that is allowed.
TEST(EngineFaults, AnExciterMayBeSilentForAWholeSecondAndNoLonger) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.silent = true;
  bench.engine.on_exciter_status(bench.exciter.status());
  bench.run(1.0);
  EXPECT_EQ(bench.engine.state(), State::measure);
  bench.step();
  EXPECT_EQ(bench.engine.state(), State::ramp_down);
  EXPECT_EQ(bench.outlet.alarms("exciter_silent"), 1);
}

TEST(EngineFaults, WhatAnExciterReportedBeforeItsLinkWentIsNotHeldAgainstIt) {
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

TEST(EngineFaults, AnAcknowledgementClearsTheExcitersFaultWhereItCan) {
  EngineBench bench;
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

TEST(EngineFaults, AFaultThatTheExciterKeepsStaysAFaultUntilItIsClearedThere) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.fault = 2;
  bench.exciter.clearable = false;
  ASSERT_TRUE(bench.run_until(State::fault, 0.2));
  EXPECT_EQ(bench.outlet.alarms("exciter_trip"), 1);
  bench.run(0.2);
  // An impatient client does not put the end of the attempt off.
  for (int i = 0; i < 30; ++i) {
    const auto told = bench.engine.acknowledge("anna");
    ASSERT_TRUE(told.ok()) << i << ": " << told.error().what;
    bench.run(0.1);
  }
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.exciter.clears, 2);
  EXPECT_EQ(bench.outlet.alarms("fault_stays"), 1);
  bench.exciter.fault = 0;
  EXPECT_TRUE(bench.run_until(State::idle, 0.5)) << "as the last acknowledgement asks";
}

TEST(EngineFaults, AnExciterThatIsNotReadyOrStopsByItselfEndsTheRun) {
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

TEST(EngineFaults, ARampThatNeverArrivesEndsTheRun) {
  EngineBench bench;
  bench.run(0.3);
  bench.exciter.deaf_to_orders = true;
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  ASSERT_TRUE(bench.run_until(State::fault, 10.0));
  EXPECT_EQ(bench.outlet.alarms("exciter_not_reached"), 1);
}

TEST(EngineFaults, AnExciterThatRunsUnaskedIsStoppedAgainAndAgain) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.runs_on = true;
  EXPECT_TRUE(bench.engine.emergency_stop("anna").ok());
  const int stops = bench.exciter.stops;
  bench.run(3.0);
  EXPECT_GE(bench.exciter.stops, stops + 4);
  EXPECT_GE(bench.outlet.alarms("stop_not_obeyed"), 1);
  EXPECT_THAT(bench.engine.acknowledge("anna").error().what, HasSubstr("still reports motion"));
}

TEST(EngineFaults, AnExciterThatIsAwayAtRestIsSaidOnceAndFaultsNothing) {
  EngineBench bench;
  for (int i = 0; i < 50; ++i) {
    bench.engine.on_exciter_error({ErrorKind::unavailable, "exciter: connection refused"});
    bench.run(0.1);
  }
  EXPECT_EQ(bench.outlet.alarms("exciter_error"), 1);
  EXPECT_EQ(bench.engine.state(), State::idle);
}

// --- sensors in motion

TEST(EngineFaults, AShortOutageCostsCyclesAndNotTheRun) {
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

TEST(EngineFaults, NotANumberInMidRunIsAStaleSensor) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.nan = true;
  ASSERT_TRUE(bench.run_until(State::fault, 3.0));
  EXPECT_EQ(bench.outlet.alarms("stale_sensor"), 1);
}

bool half_a_second_into_a_ramp_of_five(EngineBench& bench) {
  auto campaign = bench_campaign(1, 1000);
  campaign.ramp_s = 5.0;
  if (!bench.measuring(campaign) || !bench.engine.stop("anna").ok()) return false;
  bench.run(0.5);
  return bench.engine.state() == State::ramp_down;
}

TEST(EngineFaults, ARampDownThatNoSensorSeesIsStoppedAtOnce) {
  auto rig = bench_rig();
  rig.limits.stale_s = 0.2;
  EngineBench bench(rig);
  ASSERT_TRUE(half_a_second_into_a_ramp_of_five(bench));
  bench.silent = true;
  ASSERT_TRUE(bench.run_until(State::fault, 0.5)) << "the ramp takes 5 s";
  EXPECT_EQ(bench.outlet.alarms("stale_sensor"), 1);
  EXPECT_EQ(bench.exciter.stops, 1);
}

TEST(EngineFaults, ARampDownThatTheTableDoesNotFollowIsStoppedAtOnce) {
  EngineBench bench;
  ASSERT_TRUE(half_a_second_into_a_ramp_of_five(bench));
  bench.exciter.moves_part = 2.5;
  ASSERT_TRUE(bench.run_until(State::fault, 1.0)) << "three periods of 4 Hz, and no ramp of 5 s";
  EXPECT_EQ(bench.outlet.alarms("command_error"), 1);
  EXPECT_EQ(bench.exciter.stops, 1);
}

TEST(EngineFaults, AStopOnTheWayToAnotherFrequencyIsARampDown) {
  EngineBench bench;
  auto campaign = bench_campaign(2, 3);
  campaign.ramp_s = 5.0;
  ASSERT_TRUE(bench.measuring(campaign));
  ASSERT_TRUE(bench.run_until(State::ramp));
  bench.run(1.0);  // the table still has four fifths of its level
  ASSERT_TRUE(bench.engine.stop("anna").ok());
  ASSERT_TRUE(bench.run_until(State::idle, 10.0));
  EXPECT_EQ(bench.outlet.alarms("command_error"), 0);
}

TEST(EngineFaults, ARampDownWithoutAnySensorEndsWithTheRamp) {
  auto rig = bench_rig();
  rig.limits.stale_s = 0.2;
  EngineBench bench(rig);
  ASSERT_TRUE(bench.measuring());
  bench.silent = bench.excitation_silent = true;
  bench.exciter.deaf_to_orders = true;
  ASSERT_TRUE(bench.run_until(State::ramp_down, 0.3));
  const double ramp = bench_rig().exciter.ramp_s;
  ASSERT_TRUE(bench.run_until(State::fault, ramp + 0.1)) << "the drive does not confirm rest";
  EXPECT_FALSE(bench.exciter.status().running);
}

// --- the disk

TEST(EngineFaults, AFullDiskRampsDownAndFailsTheRunWithTheReason) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  const auto accepted = bench.outlet.recorded.size();
  bench.outlet.full = true;
  ASSERT_TRUE(bench.run_until(State::ramp_down, 0.1));
  ASSERT_TRUE(bench.run_until(State::idle, 3.0));
  EXPECT_EQ(last_stop(bench),
            "fail: nothing can be recorded: campaign.db: no space left on device");
  EXPECT_EQ(bench.outlet.alarms("recording_failed"), 1);
  EXPECT_LE(bench.estimator.cycles.size(), accepted + 1);
  EXPECT_EQ(bench.engine.start(bench_campaign()).error().what, "disk full");
  EXPECT_EQ(bench.engine.state(), State::idle);
}

// --- recovery, twice in a row

TEST(EngineFaults, RecoversTwiceInARowFromTheSameFault) {
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
