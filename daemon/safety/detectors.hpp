// The detectors that supervise a test, each with the action that the rig file assigns to it.
//
// Detectors hold levels, not crossings: `tripped` describes the present, before motion as well
// as in motion, and an acknowledgement checks it again. The engine reacts to them. A single
// wrong sample does not trip a limit: two in a row do (2 ms at 1 kHz). One thread; sample()
// neither allocates nor blocks.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "base/clock.hpp"
#include "config/rig.hpp"
#include "protocol/channel.hpp"

namespace shaker::daemon {

enum class Detector {
  stroke_limit,
  stroke_rate,
  excitation_limit,
  stale_sensor,
  frozen_sensor,
  command_error,
  response_change,
  under_peak
};
inline constexpr std::size_t kDetectorCount = 8;

struct DetectorRow {
  Detector detector;
  std::string_view code;   // of its alarm
  std::string_view trips;  // the condition, for README.md
  std::string_view limit;  // key in the rig file
  config::Action config::Limits::*action;
};

std::span<const DetectorRow> detector_table();
const DetectorRow& row(Detector detector);
std::string_view name(config::Action action);

struct Level {
  bool tripped = false;
  bool weak = false;  // tripped by less motion than there should be, or by a value that repeats
  bool of_frequency = false;  // value and limit are frequencies, Hz; a value of 0: any other one
  double value = 0.0, limit = 0.0;
  protocol::Channel channel = protocol::Channel::displacement;
};

class Detectors {
 public:
  explicit Detectors(const config::Limits& limits) : limits_(limits) {}

  void reset();
  // Takes one good sample; times of a channel ascend. Returns true if a limit is tripped now.
  bool sample(protocol::Channel channel, Nanoseconds t, double value);
  // Sets a level that the engine determines: ages, and figures of whole cycles.
  void report(Detector detector, const Level& level) { at(detector) = level; }

  const Level& level(Detector detector) const {
    return levels_[static_cast<std::size_t>(detector)];
  }
  config::Action action(Detector detector) const { return limits_.*row(detector).action; }
  // A sentence for the operator. Allocates.
  std::string text(Detector detector) const;

 private:
  Level& at(Detector detector) { return levels_[static_cast<std::size_t>(detector)]; }
  void rate(Nanoseconds t, double stroke);

  config::Limits limits_;
  std::array<Level, kDetectorCount> levels_{};
  int stroke_outside_ = 0, excitation_outside_ = 0, rate_outside_ = 0;
  bool anchored_ = false;
  Nanoseconds anchor_t_{};
  double anchor_ = 0.0;
};

}  // namespace shaker::daemon
