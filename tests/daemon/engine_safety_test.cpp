// The engine's reaction to mistakes of people.
#include <gtest/gtest.h>

#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::EngineBench;
using ::testing::HasSubstr;
using testing::last_stop;

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
    EXPECT_TRUE(bench.engine.stop("anna").ok());  // a stop at rest does nothing either
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

TEST(EngineSafety, AnAcknowledgementEndsAlarmsWithoutAFaultToo) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.engine.lease_lost();
  ASSERT_TRUE(bench.run_until(State::idle, 5.0));
  EXPECT_EQ(bench.outlet.alarms("acknowledged"), 0);
  EXPECT_TRUE(bench.engine.acknowledge("anna").ok());
  EXPECT_EQ(bench.outlet.all<protocol::AlarmDocument>().back().text, "acknowledged by anna");
  EXPECT_FALSE(bench.engine.acknowledge("anna").ok()) << "nothing is left";
}

TEST(EngineSafety, AStartSetsWarningsAsideAndNoErrors) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.engine.lease_lost();
  ASSERT_TRUE(bench.run_until(State::idle, 5.0));
  bench.engine.publish(
      protocol::AlarmDocument{"error", "campaign_damaged", "a.db", {}, {}, {}, {}});
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  EXPECT_EQ(bench.outlet.alarms("warnings_set_aside"), 1);
  ASSERT_TRUE(bench.engine.stop("anna").ok());
  EXPECT_TRUE(bench.engine.acknowledge("anna").ok()) << "the error has stayed";
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
  bench.engine.lease_lost();  // at rest it has no effect
  EXPECT_EQ(bench.engine.state(), State::idle);
}

}  // namespace
}  // namespace shaker::daemon
