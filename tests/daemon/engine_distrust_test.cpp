// The engine trusts its own observations more than the reports of the drive and the sensors.
#include <gtest/gtest.h>

#include "support/distrusted_rig.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using testing::bench_campaign;
using testing::bench_rig;
using testing::blind_rig;
using testing::EngineBench;
using testing::errors;
using ::testing::HasSubstr;
using testing::kPeriodS;
using testing::leaves_measure;
using testing::text_of;

TEST(EngineDistrust, SeesTheTableMoveThoughTheDriveSaysThatItHasStopped) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.runs_on = bench.exciter.claims_rest = bench.exciter.deaf_to_orders = true;
  ASSERT_TRUE(bench.engine.stop("anna").ok());
  ASSERT_TRUE(bench.run_until(State::fault, 4.0));
  EXPECT_EQ(bench.outlet.states().find("IDLE"), std::string::npos);
  EXPECT_THAT(bench.engine.state_document().reason, HasSubstr("the table still moves"));
  bench.run(1.0);
  EXPECT_THAT(text_of(bench, "stop_not_obeyed"),
              HasSubstr("the table may still be moving: use the hardware stop"));
  const int told = bench.outlet.alarms("stop_not_obeyed"), stops = bench.exciter.stops;
  bench.run(20.0);
  EXPECT_GT(bench.outlet.alarms("stop_not_obeyed"), told + 1);  // again and again
  EXPECT_GT(bench.exciter.stops, stops + 10);
  EXPECT_FALSE(bench.engine.acknowledge("anna").ok());
  bench.exciter.runs_on = false;
  bench.exciter.stop();
  bench.run(1.5);
  EXPECT_EQ(bench.outlet.alarms("at_rest"), 1);
  EXPECT_TRUE(bench.engine.acknowledge("anna").ok());
}

TEST(EngineDistrust, LeavesTheRampItsTimeWhereTheDriveSaysTooSoonThatItRests) {
  auto campaign = bench_campaign(1, 1000);
  campaign.ramp_s = 3.0;
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(campaign));
  ASSERT_TRUE(bench.engine.stop("anna"));
  bench.exciter.claims_rest = true;
  bench.run(2.9);
  EXPECT_EQ(bench.engine.state(), State::ramp_down) << bench.engine.state_document().reason;
  EXPECT_TRUE(bench.run_until(State::idle, 1.0));
  EXPECT_EQ(bench.outlet.alarms("ramp_down_unconfirmed"), 0);
}

TEST(EngineDistrust, SeesHalfASecondAfterTheRampThatTheDriveDeniesTheStop) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.runs_on = bench.exciter.claims_rest = bench.exciter.deaf_to_orders = true;
  ASSERT_TRUE(bench.engine.stop("anna").ok());
  bench.run(0.5);  // the ramp
  ASSERT_EQ(bench.engine.state(), State::ramp_down);
  EXPECT_TRUE(bench.run_until(State::fault, 0.55));
  EXPECT_EQ(bench.outlet.alarms("ramp_down_unconfirmed"), 1);
}

TEST(EngineDistrust, WaitsForADriveThatSaysThatItStillMoves) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.deaf_to_orders = true;
  ASSERT_TRUE(bench.engine.stop("anna").ok());
  bench.run(1.5);
  EXPECT_EQ(bench.engine.state(), State::ramp_down) << "its own ramp may be slower";
  bench.exciter.stop();
  EXPECT_TRUE(bench.run_until(State::idle, 0.9));
  EXPECT_EQ(bench.outlet.alarms("ramp_down_unconfirmed"), 0);
}

TEST(EngineDistrust, SeesWithinHalfASecondThatTheTableMovesInIdle) {
  EngineBench bench;
  ASSERT_TRUE(bench.idle_after_a_campaign());
  bench.run(30.0);
  bench.exciter.claims_rest = true;
  bench.exciter.set({3.0, 1.0, true, 0.0});
  bench.run(0.5);
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.exciter.amplitude(), 0.0);
  EXPECT_EQ(bench.outlet.alarms("table_moves"), 1);
  EXPECT_EQ(errors(bench), 1);
}

// After a crash, before any CHECK: the drive of another program, which says that it rests.
TEST(EngineDistrust, SeesThatTheTableMovesInIdleBeforeTheFirstCheck) {
  EngineBench bench;
  bench.run(2.0);
  ASSERT_EQ(bench.engine.state(), State::idle);
  bench.exciter.claims_rest = true;
  bench.exciter.set({3.0, 3.0, true, 0.0});
  bench.run(0.6);
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.exciter.amplitude(), 0.0);
  EXPECT_EQ(bench.outlet.alarms("table_moves"), 1);
}

// At the start a table still has the time of its dead-man.
TEST(EngineDistrust, LeavesTheDeadmanItsTimeAtTheStart) {
  EngineBench bench;
  bench.exciter.claims_rest = true;
  bench.exciter.set({3.0, 3.0, true, 0.0});
  bench.run(0.4);
  bench.exciter.stop();
  bench.run(2.0);
  EXPECT_EQ(errors(bench), 0);
}

// An incident ends where somebody acknowledges it, or where a campaign begins.
TEST(EngineDistrust, GivesTheNextCampaignsFaultAnErrorOfItsOwn) {
  for (const bool acknowledged : {true, false}) {
    EngineBench bench;
    ASSERT_TRUE(bench.idle_after_a_campaign());
    bench.outlet.hung = true;
    bench.run(0.5);
    bench.outlet.hung = false;
    ASSERT_EQ(bench.outlet.alarms("recording_failed"), 1);
    if (acknowledged) {
      ASSERT_TRUE(bench.engine.acknowledge("anna").ok());
    }
    ASSERT_TRUE(bench.measuring());
    bench.run(2.0);
    const int before = errors(bench);
    bench.gain *= 2.0;
    leaves_measure(bench);
    EXPECT_EQ(errors(bench), before + 1);
  }
}

// The fault is acknowledged before any sensor could show rest, and then another node moves the table.
TEST(EngineDistrust, SeesThatTheTableMovesInIdleAlsoWhereRestWasNotYetSeen) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  ASSERT_TRUE(bench.engine.emergency_stop("anna").ok());
  bench.run(0.1);
  ASSERT_TRUE(bench.engine.acknowledge("anna").ok());
  ASSERT_EQ(bench.engine.state(), State::idle);
  bench.exciter.claims_rest = true;
  bench.exciter.set({3.0, 1.0, true, 0.0});
  bench.run(0.8);
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.exciter.amplitude(), 0.0);
  EXPECT_EQ(bench.outlet.alarms("stop_not_obeyed"), 1);
}

TEST(EngineDistrust, SaysThatAStopWasRefusedUntilSomebodySeesRest) {
  auto rig = bench_rig();
  EngineBench bench(rig);
  ASSERT_TRUE(bench.measuring());
  bench.exciter.runs_on = true;
  bench.exciter.silent = true;  // its answers are errors from now on
  ASSERT_TRUE(bench.engine.emergency_stop("anna").ok());
  for (int i = 0; i < 120; ++i) {
    bench.engine.on_exciter_error({ErrorKind::refused, "exception 04"});
    bench.run(0.1);
  }
  EXPECT_GE(bench.outlet.alarms("stop_not_obeyed"), 2);
  EXPECT_EQ(bench.outlet.alarms("at_rest"), 0);
}

// The pause between two warnings belongs to one motion. The next motion is told at once.
TEST(EngineDistrust, WarnsAtOnceWhenATableThatHasRestedMovesAgain) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.runs_on = bench.exciter.claims_rest = true;
  ASSERT_TRUE(bench.engine.emergency_stop("anna").ok());
  bench.run(1.5);
  ASSERT_EQ(bench.outlet.alarms("stop_not_obeyed"), 1);
  bench.exciter.runs_on = false;
  bench.exciter.stop();
  bench.run(1.5);
  ASSERT_EQ(bench.outlet.alarms("at_rest"), 1);
  bench.exciter.set({3.0, 1.0, true, 0.0});
  bench.run(0.6);
  EXPECT_EQ(bench.outlet.alarms("stop_not_obeyed"), 2);
}

TEST(EngineDistrust, StopsATableThatDoesAnotherAmplitude) {
  for (const double part : {2.0, 0.5}) {
    EngineBench bench;
    ASSERT_TRUE(bench.measuring());
    bench.exciter.moves_part = part;
    EXPECT_LT(leaves_measure(bench), 3.1 * kPeriodS) << part;
    EXPECT_EQ(bench.outlet.alarms("command_error"), 1) << part;
    EXPECT_EQ(errors(bench), 1) << part;
  }
}

TEST(EngineDistrust, StopsATableThatDoesTwiceTheAmplitudeWhileItRises) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(1, 1000)).ok());
  ASSERT_TRUE(bench.run_until(State::ramp));
  bench.exciter.moves_part = 2.0;
  ASSERT_TRUE(bench.run_until(State::fault, 4.0));
  EXPECT_EQ(bench.outlet.alarms("command_error"), 1);
}

TEST(EngineDistrust, StopsATableThatDoesAnotherFrequency) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.frequency_part = 1.8;
  EXPECT_LT(leaves_measure(bench), 3.1 * kPeriodS);
  EXPECT_EQ(errors(bench), 1);
}

TEST(EngineDistrust, BelievesADriveThatReportsSomethingElse) {
  for (const bool frequency : {true, false}) {
    EngineBench bench(blind_rig());
    bench.excitation_silent = true;
    ASSERT_TRUE(bench.measuring());
    bench.exciter.admits = true;
    (frequency ? bench.exciter.frequency_part : bench.exciter.moves_part) = 1.5;
    EXPECT_LT(leaves_measure(bench), 3.1 * kPeriodS) << frequency;
    EXPECT_EQ(errors(bench), 1) << frequency;
  }
}

// A drive may report rest as soon as it has the order. The table has the time of the ramp.
TEST(EngineDistrust, LetsTheTableRampDownThoughTheDriveSaysAtOnceThatItRests) {
  auto rig = bench_rig();
  rig.exciter.ramp_s = 2.0;
  EngineBench bench(rig);
  ASSERT_TRUE(bench.measuring());
  bench.exciter.claims_rest = true;
  ASSERT_TRUE(bench.engine.stop("me").ok());
  EXPECT_TRUE(bench.run_until(State::idle, 5.0)) << bench.engine.state_document().reason;
  EXPECT_EQ(errors(bench), 0);
}

TEST(EngineDistrust, StopsWhereTheStrokeLeavesItsLimitsOnceInEachCycle) {
  auto rig = bench_rig();
  rig.limits.response_change_action = config::Action::none;  // it would detect such spikes too
  EngineBench bench(rig);
  ASSERT_TRUE(bench.measuring());
  bench.spike_m = 1.0;
  EXPECT_LT(leaves_measure(bench), 4.0 * kPeriodS);
  EXPECT_EQ(bench.outlet.alarms("stroke_limit"), 1);
}

TEST(EngineDistrust, AcceptsNoCycleWithASpikeBeyondTheLimits) {
  auto rig = bench_rig();
  rig.limits.stroke_action = config::Action::none;
  EngineBench bench(rig);
  ASSERT_TRUE(bench.measuring());
  bench.run(1.0);
  bench.spike_m = 1.0;
  bench.run(0.3);
  const auto accepted = bench.outlet.recorded.size();
  bench.run(2.0);
  EXPECT_LE(bench.outlet.recorded.size(), accepted + 1);
  for (const auto& c : bench.outlet.all<protocol::CycleDocument>()) {
    if (c.accepted) {
      EXPECT_LT(c.stroke_max_m, 0.3);
    }
  }
}

TEST(EngineDistrust, SeesASensorFreezeInALongRamp) {
  auto rig = bench_rig();
  rig.exciter.ramp_s = 20.0;
  EngineBench bench(rig);
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  ASSERT_TRUE(bench.run_until(State::ramp));
  bench.run(3.0);
  bench.frozen = true;
  bench.run(1.0);
  EXPECT_EQ(bench.outlet.alarms("frozen_sensor"), 1);
}

// The damper rings for some seconds after the stop. The engine must not take this for a moving
// table.
TEST(EngineDistrust, TakesADamperThatRingsForNoTable) {
  EngineBench bench(blind_rig());
  bench.excitation_silent = true;
  ASSERT_TRUE(bench.idle_after_a_campaign());
  bench.ring_m = 5e-3;
  bench.run(10.0);
  EXPECT_EQ(bench.engine.state(), State::idle);
  EXPECT_EQ(bench.outlet.alarms("stroke_moves"), 0);
}

// Somebody handles the damper in IDLE: the exciter is told to stop, but no alarm claims that
// the table moves.
TEST(EngineDistrust, TakesADamperThatIsHandledInIdleForNoTable) {
  EngineBench bench(blind_rig());
  bench.excitation_silent = true;
  ASSERT_TRUE(bench.idle_after_a_campaign());
  bench.run(30.0);
  const int stops = bench.exciter.stops;
  bench.wander_m = 5e-3;
  bench.run(25.0);
  EXPECT_EQ(bench.engine.state(), State::idle);
  EXPECT_THAT(text_of(bench, "stroke_moves"), HasSubstr("if nobody handles the damper"));
  EXPECT_GE(bench.outlet.alarms("stroke_moves"), 2) << "again and again";
  EXPECT_GT(bench.exciter.stops, stops);
  EXPECT_EQ(bench.outlet.alarms("stop_not_obeyed"), 0);
  EXPECT_EQ(errors(bench), 0);
}

// A level from before a stop does not tell whether the stop was obeyed. Two levels that follow it do:
// the first half a second after the stop, the second a second later.
TEST(EngineDistrust, ComparesOnlyLevelsOfTheStrokeThatFollowTheStop) {
  EngineBench bench(blind_rig());
  bench.excitation_silent = true;
  ASSERT_TRUE(bench.idle_after_a_campaign());
  bench.run(30.0);
  bench.exciter.runs_on = bench.exciter.claims_rest = true;
  bench.exciter.set({3.0, 1.0, true, 0.0});
  std::vector<double> stopped;
  while (stopped.size() < 6 && bench.clock.now() < 100s) {
    const int before = bench.exciter.stops;
    bench.step();
    if (bench.exciter.stops > before) stopped.push_back(seconds(bench.clock.now()));
  }
  ASSERT_EQ(stopped.size(), 6U);
  for (std::size_t i = 1; i < stopped.size(); ++i)
    EXPECT_GT(stopped[i] - stopped[i - 1], 1.5) << i;
}

TEST(EngineDistrust, EndsTheMotionWhenTheHeartbeatIsWithheld) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.engine.on_heartbeat_withheld("the recorder has not advanced");
  EXPECT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.exciter.amplitude(), 0.0);
  EXPECT_EQ(errors(bench), 1);
}

TEST(EngineDistrust, NamesTheCauseOfWhatFollowsFromIt) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.exciter.silent = true;
  bench.run(4.0);
  ASSERT_EQ(bench.engine.state(), State::fault);
  EXPECT_EQ(bench.outlet.alarms("exciter_silent"), 1);
  bool followed = false;
  for (const auto& a : bench.outlet.all<protocol::AlarmDocument>()) {
    if (a.code == "exciter_silent") continue;
    if (a.code == "ramp_down_unconfirmed") {
      followed = true;
      EXPECT_EQ(a.severity, "warning");
      EXPECT_EQ(a.cause, "exciter_silent");
    }
  }
  EXPECT_TRUE(followed);
}

}  // namespace
}  // namespace shaker::daemon
