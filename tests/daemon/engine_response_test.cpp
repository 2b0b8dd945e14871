// The engine compares what the damper answers with what it answered before.
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "support/distrusted_rig.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_rig;
using testing::blind_rig;
using testing::EngineBench;
using testing::errors;
using testing::kPeriodS;
using testing::leaves_measure;

// Without an accelerometer the largest stroke of the run, half from peak to peak, is the measure.
TEST(EngineDistrust, SaysThatTheStrokeIsBelowItsPeakWhereNobodySeesTheTable) {
  auto rig = blind_rig();
  rig.limits.under_peak_fraction = 0.8;
  rig.limits.response_change_action = config::Action::none;
  EngineBench bench(rig);
  bench.excitation_silent = true;
  bench.noise = 1e-6;
  ASSERT_TRUE(bench.measuring());
  bench.run(2.0);
  EXPECT_EQ(bench.outlet.alarms("under_peak"), 0);
  bench.gain *= 0.6;
  bench.run(2.0);
  ASSERT_EQ(bench.outlet.alarms("under_peak"), 1);
  for (const auto& alarm : bench.outlet.all<protocol::AlarmDocument>()) {
    if (alarm.code != "under_peak") continue;
    EXPECT_NEAR(alarm.value.value_or(0.0), 0.6 * 0.016, 2e-4);
    EXPECT_NEAR(alarm.limit.value_or(0.0), 0.8 * 0.016, 2e-4);
  }
}

struct Jump {
  const char* name;
  void (*make)(EngineBench&);
};
class ResponseJump : public ::testing::TestWithParam<std::tuple<Jump, bool>> {};

TEST_P(ResponseJump, IsStoppedWithinThreePeriods) {
  EngineBench bench(std::get<1>(GetParam()) ? blind_rig() : bench_rig());
  bench.excitation_silent = std::get<1>(GetParam());
  ASSERT_TRUE(bench.measuring());
  bench.run(2.0);
  std::get<0>(GetParam()).make(bench);
  EXPECT_LT(leaves_measure(bench), 3.1 * kPeriodS);
  EXPECT_EQ(bench.outlet.alarms("response_change"), 1);
  EXPECT_EQ(errors(bench), 1);
  const bool vanished = std::string(std::get<0>(GetParam()).name) == "vanished";
  for (const auto& alarm : bench.outlet.all<protocol::AlarmDocument>()) {
    if (alarm.code == "response_change") {
      EXPECT_EQ(alarm.value == 0.0, vanished);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Of, ResponseJump,
    ::testing::Combine(::testing::Values(Jump{"vanished", [](EngineBench& b) { b.gain = 0.0; }},
                                         Jump{"doubled", [](EngineBench& b) { b.gain *= 2.0; }},
                                         Jump{"halved", [](EngineBench& b) { b.gain *= 0.5; }},
                                         Jump{"turned", [](EngineBench& b) { b.polarity = -1.0; }},
                                         Jump{"late", [](EngineBench& b) { b.lag_turns += 0.15; }}),
                       ::testing::Bool()),
    [](const auto& jump) {
      return std::string(std::get<0>(jump.param).name) +
             (std::get<1>(jump.param) ? "_excitation_unknown" : "");
    });

// A sensor that pauses for less than stale_s, at every phase of the period: the damper is as before.
TEST(EngineDistrust, BlamesNoDamperForAPauseOfItsSensors) {
  auto rig = bench_rig();
  rig.limits.stale_s = 0.3;
  rig.limits.response_change_fraction = 0.2;
  for (const bool both : {false, true}) {
    EngineBench bench(rig);
    ASSERT_TRUE(bench.measuring());
    bench.run(2.0);
    for (int phase = 0; phase < 25; ++phase) {
      bench.silent = true;
      bench.excitation_silent = both;
      bench.run(0.09);
      bench.silent = bench.excitation_silent = false;
      bench.run(16 * kPeriodS - 0.09 + 0.01);
    }
    EXPECT_EQ(bench.outlet.alarms("response_change"), 0) << both;
    EXPECT_EQ(errors(bench), 0) << both;
    EXPECT_TRUE(bench.run_until(State::measure, 5.0)) << both;
  }
}

// A controller, or a clock that stamps the samples, that loses a tenth of a period now and then: stroke
// and table are late together.
TEST(EngineDistrust, BlamesNoDamperForATableThatIsLate) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  bench.run(2.0);
  for (int i = 0; i < 6; ++i) {
    bench.exciter.late_turns += 0.1;
    bench.run(4.0 * kPeriodS);
  }
  bench.run(1.0);
  EXPECT_EQ(bench.outlet.alarms("response_change"), 0);
  EXPECT_EQ(errors(bench), 0);
}

// The pause hides nothing: whole periods after it show what has changed meanwhile.
TEST(EngineDistrust, SeesWhatHasChangedDuringAPauseOfItsSensors) {
  auto rig = bench_rig();
  rig.limits.stale_s = 0.3;
  EngineBench bench(rig);
  ASSERT_TRUE(bench.measuring());
  bench.run(2.0);
  bench.silent = true;
  bench.run(0.09);
  bench.silent = false;
  bench.gain *= 0.5;
  EXPECT_LT(leaves_measure(bench), 4.1 * kPeriodS);
  EXPECT_EQ(bench.outlet.alarms("response_change"), 1);
}

TEST(EngineDistrust, LetsADamperChangeSlowly) {
  EngineBench bench;
  auto campaign = bench_campaign(1, 1000);
  campaign.change_detection.emplace();
  ASSERT_TRUE(bench.measuring(campaign));
  for (int i = 0; i < 400; ++i) {
    bench.gain *= 0.998;
    bench.run(0.05);
  }
  EXPECT_EQ(bench.outlet.alarms("response_change"), 0);
}

}  // namespace
}  // namespace shaker::daemon
