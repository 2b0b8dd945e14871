// What tests of an engine that distrusts drive, sensors and damper share.
#pragma once

#include <string>

#include "support/engine_bench.hpp"

namespace shaker::testing {

using daemon::State;

inline constexpr double kPeriodS = 0.25;  // of bench_campaign's first run

// Only the stroke is measured.
inline config::RigConfig blind_rig() {
  auto rig = bench_rig();
  config::CanSensor stroke;
  stroke.signals.push_back({.message = "A", .signal = "stroke"});
  rig.sensors = {stroke};
  return rig;
}

inline int errors(const EngineBench& bench) {
  int count = 0;
  for (const auto& a : bench.outlet.all<protocol::AlarmDocument>())
    count += a.severity == "error" ? 1 : 0;
  return count;
}

inline std::string text_of(const EngineBench& bench, const std::string& code) {
  for (const auto& a : bench.outlet.all<protocol::AlarmDocument>()) {
    if (a.code == code) return a.text;
  }
  return {};
}

// Time until the rig is no longer in MEASURE, s.
inline double leaves_measure(EngineBench& bench, double at_most = 5.0) {
  const Nanoseconds begin = bench.clock.now();
  while (bench.engine.state() == State::measure || bench.engine.state() == State::settle) {
    if (seconds(bench.clock.now() - begin) > at_most) break;
    bench.step();
  }
  return seconds(bench.clock.now() - begin);
}

}  // namespace shaker::testing
