// What the engine says of a campaign beside its figures.
#include <algorithm>
#include <cstdio>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/estimator_options.hpp"
#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::EngineBench;

// The plant repeats exactly but for the noise of its sensor, so the last cycles of half of the runs
// say that the sensor is noisier than what it measures.
TEST(Engine, TheEndOfARunNamesNoNoiseOfTheSensorAboveTheWholeScatter) {
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign(6, 5)).ok());
  ASSERT_TRUE(bench.run_until(State::ramp_down, 200.0));
  int as_well = 0;
  for (const auto& stop : bench.outlet.all<protocol::RunStopDocument>()) {
    EXPECT_EQ(stop.reason.rfind("5 cycles; ", 0), 0u) << stop.reason;
    double whole = 0.0, part = 0.0;
    const auto at = stop.reason.find("a point differs");
    const int read = std::sscanf(stop.reason.c_str() + std::min(at, stop.reason.size()),
                                 "a point differs from cycle to cycle by %lf m, of which the "
                                 "sensor's own noise is %lf m",
                                 &whole, &part);
    EXPECT_GE(read, 1) << stop.reason;
    as_well += read == 1 ? 1 : 0;
    EXPECT_TRUE(read != 2 || part < whole) << stop.reason;
  }
  EXPECT_GT(as_well, 0);
}

TEST(Engine, SaysThatTheEstimatorSkippedASingleCycle) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  const auto told = [&](long skipped) {
    EstimateOutcome outcome;
    outcome.cycles_skipped = skipped;
    bench.engine.on_estimate(outcome);
    const auto estimates = bench.outlet.all<protocol::EstimateDocument>();
    std::string all;
    for (const auto& warning : estimates.back().warnings)
      all += warning;
    return all.find("skipped 1 cycles") != std::string::npos;
  };
  EXPECT_FALSE(told(0));
  EXPECT_TRUE(told(1));
}

TEST(Engine, SaysWhichRunLacksWhatItsParametersGoWith) {
  EngineBench bench;
  bench.run(0.3);
  auto campaign = bench_campaign(1, 3);
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  EXPECT_EQ(bench.outlet.alarms("parameters_taken_as_one"), 0);
  ASSERT_TRUE(bench.run_until(State::measure) && bench.run_until(State::idle));

  config::EffectSpec orifice;
  orifice.effect = "orifice_damping";
  orifice.parameters["theta1"].variation.per = "run";
  campaign.model.effects = {orifice};
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  ASSERT_EQ(bench.estimator.begun_with.runs.size(), campaign.runs.size());
  EXPECT_EQ(bench.estimator.begun_with.runs[0].run, campaign.runs[0].name);
  EXPECT_EQ(bench.outlet.alarms("parameters_taken_as_one"), 0);
  ASSERT_TRUE(bench.run_until(State::measure) && bench.run_until(State::idle));

  campaign.model.effects[0].parameters["theta1"].variation.per = "group";
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  EXPECT_TRUE(bench.estimator.begun_with.runs.empty());
  ASSERT_EQ(bench.outlet.alarms("parameters_taken_as_one"), 1);
  for (const auto& alarm : bench.outlet.all<protocol::AlarmDocument>()) {
    if (alarm.code != "parameters_taken_as_one") continue;
    EXPECT_EQ(alarm.severity, "warning");
    EXPECT_EQ(alarm.text, remark(campaign));
    EXPECT_THAT(alarm.text, ::testing::StartsWith(
                                "the daemon takes theta1 as the same in all runs, although the "
                                "model lets it differ: theta1 has a value per group, and run "));
  }
}

// The work of a fit is bounded, however many runs a campaign has.
TEST(EstimatorOptions, LetSoManyValuesDifferAsTheEstimatorsThreadCanFit) {
  auto campaign = bench_campaign(12, 3);
  config::EffectSpec orifice;
  orifice.effect = "orifice_damping";
  orifice.parameters["theta1"].variation.per = "run";
  campaign.model.effects = {orifice};
  EXPECT_EQ(estimator_options(campaign).runs.size(), 12U);
  EXPECT_EQ(remark(campaign), "");
  campaign.forgetting = 0.95;
  EXPECT_TRUE(estimator_options(campaign).runs.empty());
  EXPECT_THAT(remark(campaign), ::testing::HasSubstr("the campaign forgets earlier runs"));
  campaign = bench_campaign(13, 3);
  campaign.model.effects = {orifice};
  EXPECT_TRUE(estimator_options(campaign).runs.empty());
  EXPECT_THAT(remark(campaign),
              ::testing::HasSubstr("13 values differ between the runs, and it fits 12 at most"));
}

}  // namespace
}  // namespace shaker::daemon
