// The table does another frequency than the commanded one, or answers otherwise before a run is
// steady.
#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "support/distrusted_rig.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::bench_rig;
using testing::EngineBench;
using testing::errors;
using testing::kPeriodS;
using testing::leaves_measure;
using testing::text_of;

// Time until the rig leaves RAMP, SETTLE and MEASURE, s.
double moves_on(EngineBench& bench, double at_most) {
  const Nanoseconds begin = bench.clock.now();
  const auto moves = [&] {
    const State state = bench.engine.state();
    return state == State::ramp || state == State::settle || state == State::measure;
  };
  while (moves() && seconds(bench.clock.now() - begin) < at_most)
    bench.step();
  return seconds(bench.clock.now() - begin);
}

class OtherFrequency : public ::testing::TestWithParam<double> {};

// Wherever in a period the change comes.
TEST_P(OtherFrequency, IsStoppedWithinThreePeriods) {
  for (double at = 0.0; at < kPeriodS; at += kPeriodS / 8.0) {
    EngineBench bench;
    ASSERT_TRUE(bench.measuring());
    bench.run(2.0 + at);
    bench.exciter.turn_at(GetParam());
    EXPECT_LT(leaves_measure(bench), 3.1 * kPeriodS) << at;
    EXPECT_EQ(bench.outlet.alarms("command_error"), 1) << at;
    EXPECT_EQ(bench.outlet.alarms("response_change"), 0) << at;
    EXPECT_EQ(errors(bench), 1) << at;
    EXPECT_NE(text_of(bench, "command_error").find("commanded 4 Hz"), std::string::npos)
        << text_of(bench, "command_error");
  }
}

// In a ramp from the size on that tells a frequency: a tenth of the run's.
TEST_P(OtherFrequency, IsStoppedWithinThreePeriodsInARamp) {
  auto rig = bench_rig();
  rig.exciter.ramp_s = 10.0;
  EngineBench bench(rig);
  bench.exciter.frequency_part = GetParam();
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
  while (bench.engine.state() == State::check)
    bench.step();
  const double reached = 10.0 * 0.1 / 0.25;
  EXPECT_LT(moves_on(bench, 30.0), reached + 4.0 * kPeriodS / std::min(1.0, GetParam()));
  EXPECT_EQ(bench.outlet.alarms("command_error"), 1);
  EXPECT_EQ(errors(bench), 1);
}

INSTANTIATE_TEST_SUITE_P(All, OtherFrequency,
                         ::testing::Values(0.25, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.97, 1.03, 1.05,
                                           1.1, 1.2, 1.3, 1.5, 1.8, 2.0, 3.0),
                         [](const auto& found) {
                           return fmt::format("x{:03.0f}", 100.0 * found.param);
                         });

// A drive's clock is a little off.
TEST(EngineFrequency, LetsAFrequencyBeOffByOnePerCent) {
  for (const double part : {0.99, 1.01}) {
    EngineBench bench;
    ASSERT_TRUE(bench.measuring(bench_campaign(1, 40)));
    bench.exciter.turn_at(part);
    EXPECT_GT(leaves_measure(bench, 8.0), 7.9) << part;
    EXPECT_EQ(errors(bench), 0) << part;
  }
}

TEST(EngineFrequency, BelievesADriveThatReportsSomethingElseInARamp) {
  for (const bool frequency : {true, false}) {
    auto rig = testing::blind_rig();
    rig.exciter.ramp_s = 10.0;
    EngineBench bench(rig);
    bench.excitation_silent = true;
    bench.exciter.admits = true;
    (frequency ? bench.exciter.frequency_part : bench.exciter.moves_part) = 2.0;
    bench.run(0.3);
    ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
    while (bench.engine.state() == State::check)
      bench.step();
    // An amplitude is too large once it is beyond the gentle level.
    EXPECT_LT(moves_on(bench, 30.0), frequency ? 1.5 : 6.5);
    EXPECT_EQ(bench.outlet.alarms("exciter_disagrees"), 1);
  }
}

struct Change {
  const char* name;
  void (*make)(EngineBench&);
};
class EarlyChange : public ::testing::TestWithParam<Change> {};

TEST_P(EarlyChange, IsStoppedInSettleToo) {
  auto campaign = bench_campaign();
  campaign.settle_tolerance = 1e-9;  // it stays in SETTLE
  campaign.settle_cycles_max = 1000;
  EngineBench bench;
  bench.run(0.3);
  ASSERT_TRUE(bench.engine.start(campaign).ok());
  while (bench.engine.state() != State::settle)
    bench.step();
  bench.run(2.0);
  ASSERT_EQ(bench.engine.state(), State::settle);
  ASSERT_EQ(errors(bench), 0);
  GetParam().make(bench);
  EXPECT_LT(leaves_measure(bench), 3.1 * kPeriodS);
  EXPECT_EQ(bench.outlet.alarms("response_change"), 1);
}

INSTANTIATE_TEST_SUITE_P(All, EarlyChange,
                         ::testing::Values(Change{"doubled", [](EngineBench& b) { b.gain *= 2.0; }},
                                           Change{"halved", [](EngineBench& b) { b.gain *= 0.5; }},
                                           Change{"inverted",
                                                  [](EngineBench& b) { b.gain *= -1.0; }}),
                         [](const auto& found) { return std::string(found.param.name); });

TEST(EngineFrequency, SeesAResponseThatShrinksOrTurnsWhileTheMotionRises) {
  for (const double part : {0.5, -1.0, 0.0}) {
    auto rig = bench_rig();
    rig.exciter.ramp_s = 10.0;
    EngineBench bench(rig);
    bench.run(0.3);
    ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());
    while (bench.exciter.amplitude() < 0.6 * bench_campaign().runs[0].amplitude)
      bench.step();
    ASSERT_EQ(bench.engine.state(), State::ramp);
    ASSERT_EQ(errors(bench), 0);
    bench.gain *= part;
    EXPECT_LT(moves_on(bench, 30.0), 3.1 * kPeriodS) << part;
    EXPECT_EQ(bench.outlet.alarms("response_change"), 1) << part;
  }
}

}  // namespace
}  // namespace shaker::daemon
