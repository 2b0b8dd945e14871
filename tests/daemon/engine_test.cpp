// The engine without faults: transitions, documents, and the start and end of runs.
#include "daemon/engine.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::bench_rig;
using testing::EngineBench;

TEST(Engine, ACampaignOfThreeRunsGoesThroughAllStatesAndEndsAtRest) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(3, 5)).ok());
  ASSERT_TRUE(bench.run_until(State::ramp_down, 120.0)) << bench.engine.state_document().reason;
  ASSERT_TRUE(bench.run_until(State::idle, 5.0));
  bench.run(0.1);
  EXPECT_EQ(bench.outlet.states(),
            "CHECK RAMP SETTLE MEASURE RAMP SETTLE MEASURE RAMP SETTLE MEASURE RAMP_DOWN IDLE");
  EXPECT_EQ(bench.outlet.closed, 1);
  EXPECT_FALSE(bench.exciter.alive);
  EXPECT_EQ(bench.exciter.status().running, false);
  const auto stops = bench.outlet.all<protocol::RunStopDocument>();
  ASSERT_EQ(stops.size(), 3u);
  for (const auto& stop : stops) {
    EXPECT_EQ(stop.status, "success");
    EXPECT_EQ(stop.cycles_accepted, 5);
  }
  // Exactly one estimate for each accepted cycle. Each cycle is on disk before it is published.
  EXPECT_EQ(bench.outlet.all<protocol::EstimateDocument>().size(), 15u);
  EXPECT_TRUE(bench.outlet.record_came_first);
  EXPECT_GT(bench.outlet.samples, 10'000u);
}

TEST(Engine, DocumentsOfARunComeInOrder) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(2, 3)).ok());
  ASSERT_TRUE(bench.run_until(State::ramp_down, 120.0));
  int open = 0;
  for (const auto& d : bench.outlet.documents) {
    const auto type = protocol::type_name(d);
    const int before = open;
    open += type == "run_start" ? 1 : type == "run_stop" ? -1 : 0;
    EXPECT_TRUE(open == 0 || open == 1);
    const bool inside = type == "cycle" || type == "estimate" || type == "run_stop";
    EXPECT_TRUE(!inside || before == 1) << type;
  }
  EXPECT_EQ(open, 0);
}

// A client that reads IDLE and then asks for a diagnosis must not be told that the rig still moves.
TEST(Engine, EveryStateSaysThatTheRigIsUnprotected) {
  for (const bool unprotected : {false, true}) {
    auto rig = testing::bench_rig();
    rig.unprotected = unprotected;
    EngineBench bench(rig);
    ASSERT_TRUE(bench.idle_after_a_campaign());
    const auto states = bench.outlet.all<protocol::StateDocument>();
    ASSERT_GT(states.size(), 5u);
    for (const auto& state : states)
      EXPECT_EQ(state.unprotected, unprotected) << state.state;
  }
}

TEST(Engine, TheStateIsTheOneThatAClientWasTold) {
  EngineBench bench;
  std::string differences;
  bench.outlet.on_publish = [&](const protocol::Document& d) {
    const auto* told = std::get_if<protocol::StateDocument>(&d);
    if (told != nullptr && told->state != name(bench.engine.state()))
      differences += told->state + " ";
  };
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(2, 3)).ok());
  ASSERT_TRUE(bench.run_until(State::ramp_down, 120.0));
  ASSERT_TRUE(bench.run_until(State::idle, 5.0));
  EXPECT_EQ(differences, "");
}

TEST(Engine, MotionBeginsFromZeroThroughTheRampWithAGentleStep) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 50)));
  ASSERT_GE(bench.exciter.sets.size(), 2u);
  EXPECT_EQ(bench.exciter.sets[0].amplitude, 1.0);  // a quarter of 4 m/s^2
  EXPECT_EQ(bench.exciter.sets[1].amplitude, 4.0);
  for (const auto& s : bench.exciter.sets)
    EXPECT_EQ(s.ramp_s, 0.5);
  EXPECT_TRUE(bench.exciter.alive);
}

TEST(Engine, AnotherFrequencyIsBegunFromRest) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(2, 3)).ok());
  ASSERT_TRUE(bench.run_until(State::ramp_down, 120.0));
  const auto& sets = bench.exciter.sets;
  ASSERT_GE(sets.size(), 4u);
  for (std::size_t i = 1; i < sets.size(); ++i) {
    const bool changed = sets[i].frequency_hz != sets[i - 1].frequency_hz;
    EXPECT_TRUE(!changed || sets[i - 1].amplitude == 0.0);
  }
}

TEST(Engine, CyclesAreThoseOfThePlant) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 30)));
  bench.run(10.0);
  ASSERT_EQ(bench.estimator.cycles.size(), 30u);
  const auto& c = bench.estimator.cycles.back();
  EXPECT_NEAR(c.frequency_hz, 4.0 * (1.0 + 200e-6), 4e-5);
  EXPECT_NEAR(c.amplitude, 4.0, 2e-3);
  for (std::size_t i = 0; i < 64; ++i) {
    const double tau = static_cast<double>(i) / 64.0;
    EXPECT_NEAR(c.displacement[i], 0.15 + 0.016 * std::cos(2 * std::numbers::pi * (tau - 0.1)),
                6e-5);
    EXPECT_NEAR(c.excitation[i], 4.0 * std::cos(2 * std::numbers::pi * tau), 5e-3);
  }
}

TEST(Engine, ProgressGrowsToOneAndTheEtaShrinks) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(2, 20)).ok());
  ASSERT_TRUE(bench.run_until(State::idle, 120.0));
  double last = -1.0;
  int seen = 0;
  for (const auto& s : bench.outlet.all<protocol::StateDocument>()) {
    if (!s.progress) continue;
    EXPECT_GE(*s.progress, last);
    EXPECT_LE(*s.progress, 1.0);
    last = *s.progress;
    ++seen;
  }
  EXPECT_GT(seen, 10);
  EXPECT_GT(last, 0.99);
}

std::vector<double> progress_of(const EngineBench& bench) {
  std::vector<double> out;
  for (const auto& s : bench.outlet.all<protocol::StateDocument>()) {
    if (s.progress) out.push_back(*s.progress);
  }
  return out;
}

TEST(Engine, ProgressGrowsInTheRampAndNotInTheCheck) {
  auto campaign = bench_campaign(1, 3);
  campaign.ramp_s = 3.0;
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  ASSERT_TRUE(bench.run_until(State::idle, 60.0));
  double check = 0.0, ramp = 0.0, settle = 0.0;
  for (const auto& s : bench.outlet.all<protocol::StateDocument>()) {
    if (s.state == "CHECK") check = std::max(check, s.progress.value_or(0.0));
    if (s.state == "RAMP") ramp = std::max(ramp, s.progress.value_or(0.0));
    if (s.state == "SETTLE") settle = std::max(settle, s.progress.value_or(0.0));
  }
  EXPECT_EQ(check, 0.0);
  EXPECT_GT(ramp, 0.2);  // of two ramps of 3 s and some 4 s of cycles
  EXPECT_LT(ramp, 0.7);
  EXPECT_GT(settle, 0.6);
  EXPECT_LT(settle, 0.97);
}

TEST(Engine, SaysHowLongTheWayDownStillTakes) {
  auto campaign = bench_campaign(1, 1000);
  campaign.ramp_s = 3.0;
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(campaign));
  ASSERT_TRUE(bench.engine.stop("anna"));
  ASSERT_EQ(bench.engine.state(), State::ramp_down);
  EXPECT_NEAR(bench.engine.state_document().eta_s.value_or(0.0), 3.0, 0.1);
  bench.run(2.0);
  EXPECT_NEAR(bench.engine.state_document().eta_s.value_or(0.0), 1.0, 0.1);
}

TEST(Engine, ACampaignOfASingleCycleIsNoMistake) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(1, 1)).ok());
  ASSERT_TRUE(bench.run_until(State::idle, 60.0));
  EXPECT_EQ(bench.outlet.recorded.size(), 1u);
}

TEST(Engine, ProgressOfEveryCampaignStartsAtZeroAndEndsAtOne) {
  EngineBench bench;
  bench.run(0.3);
  for (const int runs : {2, 1}) {
    const std::size_t before = progress_of(bench).size();
    ASSERT_TRUE(bench.engine.start(bench_campaign(runs, 20)).ok());
    ASSERT_TRUE(bench.run_until(State::idle, 120.0));
    auto progress = progress_of(bench);
    progress.erase(progress.begin(), progress.begin() + static_cast<std::ptrdiff_t>(before));
    ASSERT_GT(progress.size(), 5u);
    EXPECT_EQ(progress.front(), 0.0);
    EXPECT_TRUE(std::ranges::is_sorted(progress));
    EXPECT_EQ(progress.back(), 1.0);
    EXPECT_EQ(bench.outlet.all<protocol::StateDocument>().back().eta_s, 0.0);
  }
}

TEST(Engine, ProgressOfAStoppedCampaignStaysWhereItGot) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 10000)));
  bench.run(10.0);
  ASSERT_TRUE(bench.engine.stop("the test").ok());
  ASSERT_TRUE(bench.run_until(State::idle, 120.0));
  const auto progress = progress_of(bench);
  EXPECT_EQ(progress.front(), 0.0);
  EXPECT_TRUE(std::ranges::is_sorted(progress));
  EXPECT_GT(progress.back(), 0.002);
  EXPECT_LT(progress.back(), 0.02);
}

TEST(Engine, HealthComesOnceASecondWithQualityAndAge) {
  EngineBench bench;
  bench.run(0.02);
  bench.silent = true;
  bench.run(10.0);
  const auto health = bench.outlet.all<protocol::HealthDocument>();
  EXPECT_EQ(health.size(), 10u);
  ASSERT_EQ(health.back().channels.size(), 2u);
  EXPECT_EQ(health.back().channels[0].quality, "good");
  EXPECT_GT(*health.back().channels[0].age_s, 9.0);
  EXPECT_NEAR(*health.back().channels[1].rate_hz, 1000.0, 10.0);
  EXPECT_TRUE(health.back().exciter_connected);
}

TEST(Engine, AChannelIsGoodOnlyAfterItsFirstGoodSample) {
  EngineBench bench;
  bench.nan = true;
  bench.run(1.1);
  const auto health = bench.outlet.all<protocol::HealthDocument>();
  ASSERT_FALSE(health.empty());
  EXPECT_EQ(health.back().channels[0].quality, "bad");
  EXPECT_FALSE(health.back().channels[0].age_s.has_value());
}

TEST(Engine, AFailedEstimateIsADocumentWithTheReason) {
  EngineBench bench;
  bench.estimator.fails = true;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 3)));
  ASSERT_TRUE(bench.run_until(State::idle));
  const auto estimates = bench.outlet.all<protocol::EstimateDocument>();
  ASSERT_EQ(estimates.size(), 3u);
  EXPECT_FALSE(estimates[0].usable);
  ASSERT_FALSE(estimates[0].warnings.empty());
  EXPECT_EQ(estimates[0].warnings[0], "no estimate: the fit did not converge");
  EXPECT_EQ(*estimates[0].run, "r01");
  EXPECT_EQ(*estimates[0].clock, "host_receive");
}

TEST(Engine, ASlowEstimatorIsWaitedForAndThenGivenUp) {
  EngineBench bench;
  bench.estimator.answers = false;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 3)));
  bench.run(3.0);
  EXPECT_TRUE(bench.outlet.all<protocol::RunStopDocument>().empty());
  ASSERT_TRUE(bench.run_until(State::idle, 20.0));
  EXPECT_EQ(bench.outlet.alarms("estimator_slow"), 1);
  EXPECT_EQ(bench.outlet.all<protocol::RunStopDocument>().at(0).status, "success");
}

TEST(Engine, SkippedCyclesAreSaid) {
  EngineBench bench;
  bench.estimator.answers = false;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 3)));
  while (bench.estimator.asked.size() < 3)
    bench.step();
  auto outcome = bench.estimator.asked.back();
  bench.estimator.asked.clear();
  outcome.cycles_skipped = 2;
  outcome.estimate = estimator::Estimate{};
  bench.engine.on_estimate(outcome);
  const auto estimates = bench.outlet.all<protocol::EstimateDocument>();
  ASSERT_EQ(estimates.size(), 1u);
  EXPECT_EQ(*estimates[0].cycles_skipped, 2);
  EXPECT_GE(*estimates[0].latency_s, 0.0);
  EXPECT_THAT(estimates[0].warnings, ::testing::Contains(::testing::HasSubstr("skipped 2 cycles")));
  ASSERT_TRUE(bench.run_until(State::idle, 4.0));  // the engine waits for nothing any more
}

TEST(Engine, AResponseThatNeverSettlesEndsItsRunAndTheCampaignGoesOn) {
  EngineBench bench;
  bench.wander_m = 5e-4;
  bench.run(0.3);
  auto campaign = bench_campaign(2, 5);
  campaign.settle_cycles_max = 25;
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  while (bench.outlet.all<protocol::RunStopDocument>().empty())
    bench.step();
  bench.wander_m = 0.0;
  const auto stop = bench.outlet.all<protocol::RunStopDocument>()[0];
  EXPECT_EQ(stop.status, "fail");
  EXPECT_THAT(stop.reason, ::testing::HasSubstr("no steady state after 25 cycles: "));
  EXPECT_EQ(stop.cycles_accepted, 0);
  EXPECT_EQ(stop.cycles_rejected, 25);
  ASSERT_TRUE(bench.run_until(State::idle, 60.0));
  EXPECT_EQ(bench.outlet.all<protocol::RunStopDocument>().at(1).status, "success");
}

TEST(Engine, ASubharmonicResponseIsNamedAndNeverAccepted) {
  EngineBench bench;
  bench.subharmonic_m = 0.002;
  bench.run(0.3);
  auto campaign = bench_campaign(1, 5);
  campaign.settle_cycles_max = 30;
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  ASSERT_TRUE(bench.run_until(State::ramp_down, 60.0));
  const auto cycles = bench.outlet.all<protocol::CycleDocument>();
  ASSERT_GT(cycles.size(), 20u);
  EXPECT_EQ(cycles.back().subharmonic, 2);
  for (const auto& c : cycles)
    EXPECT_FALSE(c.accepted);
  EXPECT_THAT(bench.outlet.all<protocol::RunStopDocument>().at(0).reason,
              ::testing::HasSubstr("repeats only every 2 periods"));
}

TEST(Engine, WithoutAnExcitationChannelItMeasuresAndWarns) {
  auto rig = bench_rig();
  config::CanSensor stroke;
  stroke.signals.push_back({.message = "A", .signal = "stroke"});
  rig.sensors = {stroke};
  EngineBench bench(rig);
  bench.excitation_silent = true;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 3)));
  ASSERT_TRUE(bench.run_until(State::idle, 20.0));
  EXPECT_EQ(bench.outlet.alarms("excitation_not_measured"), 1);
  const auto estimates = bench.outlet.all<protocol::EstimateDocument>();
  ASSERT_EQ(estimates.size(), 3u);
  EXPECT_THAT(estimates[0].warnings, ::testing::Contains(::testing::HasSubstr("not measured")));
  EXPECT_NEAR(bench.estimator.cycles.back().frequency_hz, 4.0 * (1.0 + 200e-6), 1e-3);
  // The model is driven by what was commanded, not by nothing.
  EXPECT_EQ(bench.estimator.cycles.back().amplitude, 4.0);
  EXPECT_TRUE(bench.estimator.cycles.back().excitation.empty());
}

}  // namespace
}  // namespace shaker::daemon
