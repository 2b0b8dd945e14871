#include "daemon/safety/detectors.hpp"

#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

namespace shaker::daemon {
namespace {

using config::Limits;

constexpr std::array<DetectorRow, kDetectorCount> kTable{{
    {Detector::stroke_limit, "stroke_limit",
     "two samples in a row lie outside, or one in each of two cycles in a row",
     "stroke_min_m, stroke_max_m", &Limits::stroke_action},
    {Detector::stroke_rate, "stroke_rate",
     "the stroke is faster over 5 ms, twice in a row in one direction", "stroke_rate_max_m_s",
     &Limits::stroke_rate_action},
    {Detector::excitation_limit, "excitation_limit",
     "two samples in a row of the measured excitation lie beyond", "excitation_max_m_s2",
     &Limits::excitation_action},
    {Detector::stale_sensor, "stale_sensor", "a needed channel gives no good sample for so long",
     "stale_s", &Limits::stale_action},
    {Detector::frozen_sensor, "frozen_sensor",
     "in SETTLE or MEASURE (in RAMP four times as patiently) the stroke repeats one value for that "
     "long and a quarter of a period",
     "stale_s", &Limits::stale_action},
    {Detector::command_error, "command_error",
     "two periods in a row have a measured amplitude that far above the command, or, once it is "
     "reached, that far below it at the commanded frequency; or the table moves at a frequency "
     "that "
     "is off by more than 2.5 %",
     "command_error_fraction", &Limits::command_error_action},
    {Detector::response_change, "response_change",
     "in SETTLE or MEASURE the stroke's answer has vanished, or has changed by this part of what "
     "it was, for two periods in a row; on the way up, where it shrinks or turns",
     "response_change_fraction", &Limits::response_change_action},
    {Detector::under_peak, "under_peak",
     "two cycles in a row peak below this part of the command (of the run's largest stroke where "
     "the "
     "excitation is not measured)",
     "under_peak_fraction", &Limits::under_peak_action},
}};

// Over 5 ms a noise of 2e-5 m gives 6 mm/s, far below any limit, and the delay is still small.
constexpr Nanoseconds kRateSpan = std::chrono::milliseconds(5);
constexpr Nanoseconds kRateForget = std::chrono::milliseconds(250);
constexpr int kInARow = 2;

}  // namespace

std::span<const DetectorRow> detector_table() {
  return kTable;
}
const DetectorRow& row(Detector detector) {
  return kTable[static_cast<std::size_t>(detector)];
}

std::string_view name(config::Action action) {
  constexpr std::string_view names[] = {"none", "indicate", "hold", "ramp_down", "stop"};
  return names[static_cast<int>(action)];
}

void Detectors::reset() {
  levels_ = {};
  stroke_outside_ = excitation_outside_ = rate_outside_ = 0;
  anchored_ = false;
}

bool Detectors::sample(protocol::Channel channel, Nanoseconds t, double value) {
  if (channel == protocol::Channel::displacement) {
    const bool low = value<limits_.stroke_min_m, high = value> limits_.stroke_max_m;
    stroke_outside_ = low || high ? stroke_outside_ + 1 : 0;
    at(Detector::stroke_limit) = {.tripped = stroke_outside_ >= kInARow,
                                  .value = value,
                                  .limit = low ? limits_.stroke_min_m : limits_.stroke_max_m,
                                  .channel = channel};
    rate(t, value);
  } else if (channel == protocol::Channel::excitation) {
    const bool beyond = std::abs(value) > limits_.excitation_max_m_s2;
    excitation_outside_ = beyond ? excitation_outside_ + 1 : 0;
    at(Detector::excitation_limit) = {.tripped = excitation_outside_ >= kInARow,
                                      .value = value,
                                      .limit = limits_.excitation_max_m_s2,
                                      .channel = channel};
  }
  return level(Detector::stroke_limit).tripped || level(Detector::stroke_rate).tripped ||
         level(Detector::excitation_limit).tripped;
}

void Detectors::rate(Nanoseconds t, double stroke) {
  const Nanoseconds span = t - anchor_t_;
  if (!anchored_ || span > kRateForget || span < Nanoseconds{0}) {
    anchored_ = true;
    rate_outside_ = 0;
  } else if (span < kRateSpan) {
    return;
  } else {
    const double speed = (stroke - anchor_) / seconds(span);
    const int sign = speed > 0.0 ? 1 : -1;
    // A single wrong sample gives two speeds of opposite sign; a real motion keeps its sign.
    if (std::abs(speed) <= limits_.stroke_rate_max_m_s) {
      rate_outside_ = 0;
    } else {
      rate_outside_ = rate_outside_ * sign > 0 ? rate_outside_ + sign : sign;
    }
    at(Detector::stroke_rate) = {.tripped = std::abs(rate_outside_) >= kInARow,
                                 .value = speed,
                                 .limit = limits_.stroke_rate_max_m_s,
                                 .channel = protocol::Channel::displacement};
  }
  anchor_t_ = t;
  anchor_ = stroke;
}

std::string Detectors::text(Detector detector) const {
  const Level& l = level(detector);
  const auto channel = protocol::name(l.channel);
  switch (detector) {
    case Detector::stroke_limit:
      return fmt::format(
          "stroke {:.4f} m is outside {:g}..{:g} m; check the damper, the amplitude and the "
          "sensor's sign",
          l.value, limits_.stroke_min_m, limits_.stroke_max_m);
    case Detector::stroke_rate:
      return fmt::format(
          "the stroke moves at {:.3g} m/s, more than {:g} m/s; check the damper and the sensor",
          l.value, l.limit);
    case Detector::excitation_limit:
      return fmt::format(
          "measured excitation {:.3g} m/s^2 is beyond {:g} m/s^2; lower the amplitude "
          "or check the exciter",
          l.value, l.limit);
    case Detector::stale_sensor:
      return fmt::format(
          "no good {} sample for {:.3f} s, more than {:g} s; check the sensor, its "
          "cable and its link",
          channel, l.value, l.limit);
    case Detector::frozen_sensor:
      return fmt::format(
          "the {} sensor repeats one value for {:.3f} s while the table moves; check the sensor",
          channel, l.value);
    case Detector::command_error:
      if (l.of_frequency) {
        return fmt::format(
            "the table moves at {} than the commanded {:.4g} Hz; check the exciter's setpoint and "
            "its units",
            l.value > 0.0 ? fmt::format("{:.4g} Hz rather", l.value) : "another frequency",
            l.limit);
      }
      return fmt::format(
          "measured amplitude {:.4g} m/s^2 differs from the commanded {:.4g} m/s^2 by "
          "more than {:g} %; check the exciter's tuning and the accelerometer's scale",
          l.value, l.limit, 100.0 * limits_.command_error_fraction);
    case Detector::response_change:
      return fmt::format(
          "the stroke's answer to the excitation has jumped to {:.3g} of what it was, or turned "
          "round; check the displacement sensor, its mounting, and the damper itself",
          l.value);
    case Detector::under_peak:
      return fmt::format("peak {:.4g} {} stays below {:.4g}; check what is loose or stuck", l.value,
                         protocol::unit(l.channel), l.limit);
  }
  return {};
}

}  // namespace shaker::daemon
