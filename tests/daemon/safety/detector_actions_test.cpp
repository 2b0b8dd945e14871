// Tests every detector with every action that a rig file may choose for it.
#include <tuple>

#include <gtest/gtest.h>

#include "daemon/safety/detectors.hpp"
#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using config::Action;
using testing::bench_campaign;
using testing::bench_rig;
using testing::EngineBench;

void cause(EngineBench& bench, Detector detector) {
  switch (detector) {
    case Detector::stroke_limit:
      bench.mean = 0.31;
      break;
    case Detector::stroke_rate:
      bench.gain = 0.033;
      break;
    case Detector::excitation_limit:
      bench.exciter.moves_part = 5.0;
      break;
    case Detector::stale_sensor:
      bench.silent = true;
      break;
    case Detector::frozen_sensor:
      bench.frozen = true;
      break;
    case Detector::command_error:
      bench.exciter.moves_part = 0.7;
      break;
    case Detector::response_change:
      bench.gain = 0.002;
      break;
    case Detector::under_peak:
      bench.exciter.moves_part = 0.85;
      break;
  }
}

void cure(EngineBench& bench) {
  bench.mean = 0.15;
  bench.gain = 0.004;
  bench.exciter.moves_part = 1.0;
  bench.silent = bench.frozen = false;
}

config::RigConfig rig_with(Detector detector, Action action) {
  auto rig = bench_rig();
  for (const auto& r : detector_table())
    rig.limits.*r.action = Action::none;
  rig.limits.*row(detector).action = action;
  if (detector == Detector::under_peak) rig.limits.under_peak_fraction = 0.9;
  return rig;
}

class DetectorAction : public ::testing::TestWithParam<std::tuple<int, Action>> {
 protected:
  Detector detector() const { return static_cast<Detector>(std::get<0>(GetParam())); }
  Action action() const { return std::get<1>(GetParam()); }
  int alarms(const EngineBench& bench) const {
    return bench.outlet.alarms(std::string(row(detector()).code));
  }
};

TEST_P(DetectorAction, DoesWhatTheRigFileSays) {
  EngineBench bench(rig_with(detector(), action()));
  ASSERT_TRUE(bench.measuring()) << bench.engine.state_document().reason;
  const int stops = bench.exciter.stops;
  ASSERT_EQ(alarms(bench), 0);
  cause(bench, detector());
  bench.run(2.0);
  const bool moves = bench.exciter.status().running;
  switch (action()) {
    case Action::none:
      EXPECT_EQ(alarms(bench), 0);
      EXPECT_TRUE(moves);
      break;
    case Action::indicate:
      EXPECT_GE(alarms(bench), 1);
      EXPECT_TRUE(moves);
      break;
    case Action::hold: {
      EXPECT_GE(alarms(bench), 1);
      EXPECT_TRUE(moves);
      const auto before = bench.outlet.recorded.size();
      bench.run(1.0);
      EXPECT_EQ(bench.outlet.recorded.size(), before);  // holds: accepts nothing
      cure(bench);
      bench.run(6.0);
      EXPECT_GT(bench.outlet.recorded.size(), before);  // continues by itself
      EXPECT_EQ(bench.exciter.stops, stops);
      break;
    }
    case Action::ramp_down: {
      EXPECT_GE(alarms(bench), 1);
      EXPECT_EQ(bench.outlet.states(), "CHECK RAMP SETTLE MEASURE RAMP_DOWN FAULT");
      EXPECT_EQ(bench.exciter.sets.back().amplitude, 0.0);
      EXPECT_FALSE(moves);
      EXPECT_EQ(bench.outlet.all<protocol::RunStopDocument>().at(0).status, "fail");
      break;
    }
    case Action::stop: {
      EXPECT_GE(alarms(bench), 1);
      EXPECT_EQ(bench.outlet.states(), "CHECK RAMP SETTLE MEASURE FAULT");
      EXPECT_GT(bench.exciter.sets.back().amplitude, 0.0);  // no ramp: at once
      EXPECT_GT(bench.exciter.stops, stops);
      EXPECT_FALSE(moves);
      break;
    }
  }
}

class LatchingAction : public DetectorAction {};

TEST_P(LatchingAction, LatchesUntilItsCauseIsGoneAndTheOperatorSaysSo) {
  EngineBench bench(rig_with(detector(), action()));
  ASSERT_TRUE(bench.measuring());
  cause(bench, detector());
  ASSERT_TRUE(bench.run_until(State::fault, 5.0));
  bench.run(1.0);
  EXPECT_FALSE(bench.engine.start(bench_campaign()).ok());
  // What is visible only in motion (rate, whole cycles) cannot persist at rest.
  const bool shows_at_rest =
      detector() == Detector::stroke_limit || detector() == Detector::stale_sensor;
  const auto refused = bench.engine.acknowledge("test");
  EXPECT_EQ(refused.ok(), !shows_at_rest);
  cure(bench);
  bench.run(0.5);
  if (shows_at_rest) {
    EXPECT_THAT(refused.error().what, ::testing::StartsWith("not acknowledged: "));
    EXPECT_TRUE(bench.engine.acknowledge("test").ok());
  }
  EXPECT_EQ(bench.engine.state(), State::idle);
  bench.run(3.0);
  EXPECT_EQ(bench.engine.state(), State::idle);  // motion never restarts by itself
  EXPECT_FALSE(bench.exciter.status().running);
}

std::string case_name(const ::testing::TestParamInfo<std::tuple<int, Action>>& one) {
  return std::string(row(static_cast<Detector>(std::get<0>(one.param))).code) + "_" +
         std::string(name(std::get<1>(one.param)));
}

const auto kEach = ::testing::Range(0, static_cast<int>(kDetectorCount));
INSTANTIATE_TEST_SUITE_P(
    All, DetectorAction,
    ::testing::Combine(kEach, ::testing::Values(Action::none, Action::indicate, Action::hold,
                                                Action::ramp_down, Action::stop)),
    case_name);
INSTANTIATE_TEST_SUITE_P(All, LatchingAction,
                         ::testing::Combine(kEach,
                                            ::testing::Values(Action::ramp_down, Action::stop)),
                         case_name);

TEST(Detectors, OneWildSampleTripsNothing) {
  config::Limits limits;
  Detectors detectors(limits);
  for (int i = 0; i < 100; ++i) {
    const double u = i == 50 ? 5.0 : 0.1;
    EXPECT_FALSE(detectors.sample(protocol::Channel::displacement, from_seconds(1e-3 * i), u)) << i;
  }
}

TEST(Detectors, TwoSamplesInARowTripAndOneInsideClears) {
  config::Limits limits;
  Detectors detectors(limits);
  const auto at = [&](int i, double u) {
    return detectors.sample(protocol::Channel::displacement, from_seconds(1e-3 * i), u);
  };
  EXPECT_FALSE(at(0, 0.301));
  EXPECT_TRUE(at(1, 0.301));
  EXPECT_FALSE(at(2, 0.299));
  EXPECT_FALSE(at(3, -0.001));
  EXPECT_TRUE(at(4, -0.001));
  EXPECT_EQ(detectors.text(Detector::stroke_limit),
            "stroke -0.0010 m is outside 0..0.3 m; check the damper, the amplitude and the "
            "sensor's sign");
}

TEST(Detectors, TwoSpeedsInARowTripAndOneBelowClears) {
  config::Limits limits;
  limits.stroke_rate_max_m_s = 1.0;
  Detectors detectors(limits);
  const auto at = [&](int i, double u) {
    return detectors.sample(protocol::Channel::displacement, from_seconds(1e-2 * i), u);
  };
  EXPECT_FALSE(at(0, 0.100));
  EXPECT_FALSE(at(1, 0.111)) << "1.1 m/s once";
  EXPECT_TRUE(at(2, 0.122)) << "1.1 m/s twice";
  EXPECT_FALSE(at(3, 0.130)) << "0.8 m/s";
  EXPECT_FALSE(at(4, 0.119)) << "1.1 m/s downwards once";
  EXPECT_FALSE(at(5, 0.130)) << "and back: a wild sample changes its sign";
  EXPECT_TRUE(at(6, 0.141));
}

TEST(Detectors, HaveOneRowEachWithAStableCode) {
  for (std::size_t i = 0; i < kDetectorCount; ++i) {
    EXPECT_EQ(static_cast<std::size_t>(detector_table()[i].detector), i);
    EXPECT_FALSE(detector_table()[i].code.empty());
  }
}

}  // namespace
}  // namespace shaker::daemon
