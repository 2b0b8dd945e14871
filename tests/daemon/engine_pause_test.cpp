// A pause: rest without the end of the campaign, and what may end it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::EngineBench;
using ::testing::HasSubstr;
using testing::last_stop;

class EnginePause : public ::testing::Test {
 protected:
  // In PAUSE, from MEASURE of a campaign of two runs, with a client in control.
  bool paused(int cycles = 20) {
    bench.engine.set_controlled(true);
    if (!bench.measuring(bench_campaign(2, cycles))) return false;
    bench.run(1.0);
    return bench.engine.pause("anna").ok() && bench.run_until(State::pause, 5.0);
  }
  bool still() const { return !bench.exciter.status().running && !bench.exciter.alive; }
  std::size_t orders() const { return bench.exciter.sets.size(); }

  EngineBench bench;
};

TEST_F(EnginePause, RampsToRestAndGoesOnWhereItWas) {
  ASSERT_TRUE(paused());
  EXPECT_TRUE(still());
  EXPECT_EQ(bench.outlet.closed, 0);
  EXPECT_TRUE(bench.outlet.all<protocol::RunStopDocument>().empty());
  const auto before = bench.outlet.recorded.size();
  ASSERT_GT(before, 0u);
  bench.run(30.0);
  EXPECT_TRUE(still());
  ASSERT_TRUE(bench.engine.resume("anna").ok());
  ASSERT_TRUE(bench.run_until(State::idle, 120.0)) << bench.engine.state_document().reason;
  EXPECT_EQ(
      bench.outlet.states(),
      "CHECK RAMP SETTLE MEASURE RAMP_DOWN PAUSE CHECK RAMP SETTLE MEASURE RAMP SETTLE MEASURE "
      "RAMP_DOWN IDLE");
  const auto stops = bench.outlet.all<protocol::RunStopDocument>();
  ASSERT_EQ(stops.size(), 2u);
  for (const auto& stop : stops) {
    EXPECT_EQ(stop.status, "success");
    EXPECT_EQ(stop.cycles_accepted, 20);
  }
  EXPECT_EQ(bench.outlet.recorded.size(), 40u);
  EXPECT_EQ(bench.estimator.begun, 1) << "the estimate goes on, too";
}

TEST_F(EnginePause, ProvesTheSignAtTheGentleLevelAgain) {
  ASSERT_TRUE(paused());
  const std::size_t before = orders();
  bench.polarity = -1.0;
  ASSERT_TRUE(bench.engine.resume("anna").ok());
  ASSERT_TRUE(bench.run_until(State::fault, 30.0));
  EXPECT_EQ(bench.exciter.sets.at(before).amplitude, 1.0) << "a quarter of 4 m/s^2";
  EXPECT_THAT(last_stop(bench), HasSubstr("wrong sign"));
}

TEST_F(EnginePause, ResumesOnlyWithAClientInControl) {
  ASSERT_TRUE(paused());
  const std::size_t before = orders();
  bench.engine.lease_lost();
  EXPECT_THAT(bench.engine.resume("otto").error().what, HasSubstr("nobody is in control"));
  bench.run(5.0);
  EXPECT_EQ(orders(), before);
  EXPECT_EQ(bench.engine.state(), State::pause);
  bench.engine.set_controlled(true);
  EXPECT_TRUE(bench.engine.resume("otto").ok());
}

TEST_F(EnginePause, StaysAtRestWhenTheClientGoes) {
  ASSERT_TRUE(paused());
  const std::size_t before = orders();
  bench.engine.lease_lost();
  bench.run(60.0);
  EXPECT_EQ(bench.engine.state(), State::pause);
  EXPECT_EQ(orders(), before);
  EXPECT_TRUE(still());
  EXPECT_EQ(bench.outlet.alarms("lease_lost"), 1);
}

TEST_F(EnginePause, ComesToRestWhenTheClientGoesOnTheWay) {
  bench.engine.set_controlled(true);
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 1000)));
  ASSERT_TRUE(bench.engine.pause("anna").ok());
  bench.run(0.1);
  bench.engine.lease_lost();
  ASSERT_TRUE(bench.run_until(State::pause, 5.0));
  EXPECT_TRUE(still());
}

TEST_F(EnginePause, IsEndedByAStopAtRestAndOnTheWay) {
  for (const bool on_the_way : {false, true}) {
    EngineBench own;
    own.engine.set_controlled(true);
    ASSERT_TRUE(own.measuring(bench_campaign(1, 1000)));
    ASSERT_TRUE(own.engine.pause("anna").ok());
    if (!on_the_way) {
      ASSERT_TRUE(own.run_until(State::pause, 5.0));
    }
    ASSERT_TRUE(own.engine.stop("otto").ok());
    ASSERT_TRUE(own.run_until(State::idle, 5.0));
    own.run(0.2);
    EXPECT_EQ(last_stop(own), "abort: stopped by otto");
    EXPECT_EQ(own.outlet.closed, 1);
    EXPECT_FALSE(own.engine.resume("anna").ok());
  }
}

TEST_F(EnginePause, IsEndedByAFaultOnTheWay) {
  bench.engine.set_controlled(true);
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 1000)));
  ASSERT_TRUE(bench.engine.pause("anna").ok());
  bench.silent = true;  // stale_action is to ramp down
  ASSERT_TRUE(bench.run_until(State::fault, 5.0));
  EXPECT_THAT(last_stop(bench), HasSubstr("no good displacement sample"));
}

TEST_F(EnginePause, EndsInFaultWhenTheTableMoves) {
  ASSERT_TRUE(paused());
  bench.run(1.0);
  bench.exciter.set({.frequency_hz = 4.0, .amplitude = 2.0, .enable = true, .ramp_s = 0.0});
  ASSERT_TRUE(bench.run_until(State::fault, 1.0));
  EXPECT_EQ(bench.outlet.alarms("table_moves"), 1);
  bench.run(0.2);
  EXPECT_TRUE(still());
  EXPECT_EQ(bench.outlet.closed, 1);
}

TEST_F(EnginePause, LetsTheDamperBeHandled) {
  ASSERT_TRUE(paused());
  bench.run(25.0);
  bench.mean = 0.35;  // beyond stroke_max_m: somebody holds the damper
  bench.run(2.0);
  EXPECT_EQ(bench.engine.state(), State::pause);
  EXPECT_THAT(bench.engine.resume("anna").error().what, HasSubstr("stroke 0.35"));
  bench.mean = 0.15;
  bench.run(1.0);
  EXPECT_TRUE(bench.engine.resume("anna").ok());
}

TEST_F(EnginePause, EndsWhereNothingCanBeRecordedAnyMore) {
  ASSERT_TRUE(paused());
  bench.outlet.full = true;
  ASSERT_TRUE(bench.engine.resume("anna").ok());
  ASSERT_TRUE(bench.run_until(State::idle, 5.0));
  EXPECT_EQ(bench.outlet.alarms("recording_failed"), 1);
}

TEST_F(EnginePause, RecordsNoSamplesAtRest) {
  ASSERT_TRUE(paused());
  const std::size_t before = bench.outlet.samples;
  bench.run(10.0);
  EXPECT_EQ(bench.outlet.samples, before);
}

TEST_F(EnginePause, TwiceIsNoErrorAndElsewhereItIsRefused) {
  EXPECT_THAT(bench.engine.pause("anna").error().what,
              HasSubstr("the rig is in IDLE; only a campaign in motion can be paused"));
  EXPECT_THAT(bench.engine.resume("anna").error().what, HasSubstr("nothing is paused"));
  ASSERT_TRUE(paused());
  EXPECT_TRUE(bench.engine.pause("otto").ok());
  EXPECT_THAT(bench.engine.start(bench_campaign()).error().what, HasSubstr("resume its campaign"));
  ASSERT_TRUE(bench.engine.resume("anna").ok());
  EXPECT_THAT(bench.engine.resume("anna").error().what, HasSubstr("the rig is in CHECK"));
  EXPECT_THAT(bench.engine.pause("anna").error().what, HasSubstr("the rig is in CHECK"));
}

// The run has its cycles and its estimates are awaited: the pause does not lose the next run.
TEST_F(EnginePause, BetweenTwoRunsGoesOnWithTheNext) {
  bench.engine.set_controlled(true);
  bench.estimator.answers = false;
  ASSERT_TRUE(bench.measuring(bench_campaign(2, 3)));
  while (bench.estimator.asked.size() < 3)
    bench.step();
  ASSERT_TRUE(bench.engine.pause("anna").ok());
  ASSERT_TRUE(bench.run_until(State::pause, 5.0));
  EXPECT_THAT(bench.engine.resume("anna").error().what, HasSubstr("estimates of run \"r01\""));
  bench.estimator.answers = true;
  bench.run(0.1);
  ASSERT_TRUE(bench.engine.resume("anna").ok());
  ASSERT_TRUE(bench.run_until(State::idle, 60.0));
  const auto starts = bench.outlet.all<protocol::RunStartDocument>();
  ASSERT_EQ(starts.size(), 2u);
  EXPECT_EQ(starts[1].run, "r02");
  EXPECT_EQ(last_stop(bench).substr(0, 7), "success");
}

}  // namespace
}  // namespace shaker::daemon
