// Supervision in every state: levels and ages of the channels, the table at rest, and the reports of
// the exciter.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"

namespace shaker::daemon {
namespace {

using protocol::Channel;

constexpr int kInARow = 2;                       // periods or reports: one may be disturbed
constexpr double kFrozenRising = 4.0;            // factor on the limit while the motion grows
constexpr double kReportedFrequencyPart = 0.02;  // of the setpoint; registers are coarse
constexpr double kFloorPart = 1e-3;     // of the smallest amplitude: noise of a sensor without any
constexpr double kLeastStroke = 1e-7;   // m; lower limit for a sensor without noise
constexpr double kSeenS = 0.2;          // a channel with a younger sample is alive
constexpr double kStopTakesS = 0.1;     // delay of a stop that is obeyed
constexpr double kRingsS = 20.0;        // a damper may ring for this long
constexpr double kRingsPart = 0.9;      // and its level falls below this part within a second
constexpr double kDriveReportsS = 0.5;  // a drive that answers reports within this time
constexpr double kAgainS = 5.0, kAgainMostS = 60.0;  // between two warnings of possible motion

}  // namespace

// --- levels and ages

void Engine::Impl::watch_levels() {
  if (resting()) return;
  for (const auto& r : detector_table()) {
    const auto i = static_cast<std::size_t>(r.detector);
    const bool waits = awaits_report(r.detector);
    const bool tripped = detectors.level(r.detector).tripped && !waits;
    const bool rose = tripped && !was_tripped[i];
    was_tripped[i] = tripped;
    if (rose) act(r.detector);
    if (resting()) return;
  }
}

// A drive that has stopped causes less motion than there should be, and a sensor that repeats one
// value. Such a finding waits for the drive's next report, so that the alarm names the drive.
bool Engine::Impl::awaits_report(Detector detector) {
  auto& seen = weak_since[static_cast<std::size_t>(detector)];
  if (const Level& level = detectors.level(detector); !level.tripped || !level.weak) {
    seen.reset();
    return false;
  }
  if (!seen) seen = clock.now();
  return !(status && status->t > *seen) && since(*seen) < kDriveReportsS;
}

void Engine::Impl::watch_ages() {
  using protocol::Channel;
  Level stale{.limit = rig.limits.stale_s};
  Level frozen{.limit = rig.limits.stale_s};
  for (const Channel c : {Channel::displacement, Channel::excitation}) {
    if (c == Channel::excitation && !excitation_measured) continue;
    const double age = since(monitor(c).last_good());
    if (age > stale.limit && age > stale.value) {
      stale.value = age;
      stale.channel = c;
      stale.tripped = true;
    }
  }
  // At small strokes only a sensor that shows noise at rest can be called frozen.
  const bool rising = state == State::ramp && stroke_lives;
  if (cutting() || rising) {
    frozen.value = since(monitor(Channel::displacement).last_change());
    frozen.limit = std::max(rising ? kFrozenRising * frozen.limit : frozen.limit,
                            (rising ? 1.0 : 0.25) / run().frequency_hz);
    frozen.tripped = frozen.weak = frozen.value > frozen.limit;
  }
  // CHECK reports a sensor that is not there yet in its own, milder words.
  if (state == State::check) return;
  detectors.report(Detector::stale_sensor, stale);
  detectors.report(Detector::frozen_sensor, frozen);
  watch_levels();
}

void Engine::Impl::watch_hold() {
  if (held_by.empty()) return;
  bool still = false;
  for (const auto& r : detector_table()) {
    still = still || (detectors.action(r.detector) == config::Action::hold &&
                      detectors.level(r.detector).tripped);
  }
  if (!still || !cutting()) {
    held_by.clear();
    gate.interrupt();
    return;
  }
  const double longest = campaign->settle_cycles_max / run().frequency_hz;
  if (since(held_since) > longest) {
    ramp_down("fail", fmt::format("held for {:.0f} s: {}", longest, held_by), After::fault);
  }
}

// --- the table at rest

void Engine::Impl::learn_rest() {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& r : campaign->runs)
    least = std::min(least, r.amplitude);
  const ChannelMonitor& stroke = monitor(Channel::displacement);
  stroke_lives = stroke.rest_noise() > 0.0;
  stroke_noise = stroke.rest_noise();
  const ChannelMonitor& table = monitor(Channel::excitation);
  table_noise = table.rest_count() > 1 ? table.rest_noise() : 0.0;
  if (moves_nothing()) return;
  rest(Channel::displacement).learn(std::max(stroke_noise, kLeastStroke));
  rest(Channel::excitation)
      .learn(table.rest_count() > 1 ? std::max(table_noise, kFloorPart * least) : 0.0);
}

bool Engine::Impl::table_is_seen() const {
  return rest(Channel::excitation).knows_rest() &&
         since(monitor(Channel::excitation).last_good()) < kSeenS;
}

bool Engine::Impl::stroke_is_seen() const {
  return since(monitor(Channel::displacement).last_good()) < kSeenS;
}

// Motion of the table since `from` according to our own sensor of the excitation.
Motion Engine::Impl::table_motion(Nanoseconds from) const {
  const RestWatch& table = rest(Channel::excitation);
  if (!table_is_seen() || !table.covers_since(from)) return Motion::unknown;
  return table.moves() ? Motion::moves : Motion::rests;
}

// The same if only the stroke is measured. The level of a damper that rings after a stop
// decreases from second to second; a sustained level is motion.
Motion Engine::Impl::stroke_motion(Nanoseconds from) {
  const RestWatch& stroke = rest(Channel::displacement);
  if (!stroke.knows_rest() || !stroke_is_seen() || !stroke.covers_since(from))
    return Motion::unknown;
  if (!stroke.moves()) return Motion::rests;
  if (since(stop_ordered) > kRingsS) return Motion::moves;
  if (since(level_taken) < 1.0) return Motion::unknown;
  const bool sustained = level_taken > stop_ordered && stroke.level() > kRingsPart * level_before;
  level_before = stroke.level();
  level_taken = clock.now();
  return sustained ? Motion::moves : Motion::unknown;
}

// Nothing may move in IDLE, CHECK and FAULT. Any motion is answered by an order to stop. The
// warning is repeated as long as no sensor has shown rest after that order.
void Engine::Impl::watch_rest() {
  const bool answered = status && status->t > stop_ordered && !exciter_error;
  const double deadman = status && status->heartbeat_timeout_s ? *status->heartbeat_timeout_s
                                                               : rig.exciter.deadman_max_s;
  const double takes = kStopTakesS + (answered ? 0.0 : std::max(0.0, deadman));
  const Nanoseconds from = stop_ordered + from_seconds(takes);
  const Motion own = table_is_seen() ? table_motion(from) : stroke_motion(from);
  const bool says_runs = !proving && answered && status->running &&
                         since(stop_ordered) >= kStopAgainS && since(entered) >= kStopAgainS;
  if (own == Motion::moves) {
    const bool table = table_is_seen();
    const double level =
        std::numbers::sqrt2 * rest(table ? Channel::excitation : Channel::displacement).level();
    return moves_unasked(
        table
            ? fmt::format("the table moves with {:.2g} m/s^2 although nothing is commanded", level)
            : fmt::format("the stroke moves by {:.2g} m although nothing is commanded", level),
        table);
  }
  if (says_runs) {
    return moves_unasked("the exciter reports that it runs although nothing is commanded", true);
  }
  if (!awaits_rest) return;
  if (own == Motion::rests || (answered && !status->running && !table_is_seen())) {
    awaits_rest = false;
    if (std::exchange(may_move_told, 0) > 0) {
      alarm("info", "at_rest",
            own == Motion::rests ? "the table is at rest: the sensor shows it"
                                 : "the table is at rest, as the exciter says");
    }
    return;
  }
  if (!answered && since(stop_ordered) > takes + kStopAgainS) {
    say_may_move(exciter_error ? fmt::format("the stop is not confirmed ({})", exciter_error->what)
                               : "the stop is not confirmed: the exciter does not answer");
  }
}

// `sure`: the table moves; otherwise somebody may be handling the damper.
void Engine::Impl::moves_unasked(const std::string& why, bool sure) {
  const bool again = awaits_rest;  // a stop was ordered before
  if (since(stop_ordered) >= kStopAgainS) halt();
  if (!sure && !again) {
    alarm_once("stroke_moves", why + "; if nobody handles the damper, use the hardware stop");
    return;
  }
  awaits_rest = true;
  const bool in_fault = state == State::fault;
  const std::string what = why + "; it was told to stop";
  if (sure && !in_fault) trip(what);
  if (again || in_fault) return say_may_move(why);
  alarm("error", "table_moves", what, config::Action::stop);
}

void Engine::Impl::say_may_move(const std::string& why) {
  const double pause = std::min(kAgainMostS, kAgainS * std::exp2(std::max(0, may_move_told - 1)));
  if (may_move_told > 0 && since(may_move_said) < pause) return;
  may_move_said = clock.now();
  ++may_move_told;
  alarm("error", "stop_not_obeyed", why + "; the table may still be moving: use the hardware stop",
        config::Action::stop);
}

// --- what the exciter says

void Engine::Impl::device_trouble(const std::string& code, const std::string& why) {
  if (!moving()) return alarm_once(code, why);
  if (state == State::ramp_down) {
    const std::string both = reason.find(why) != std::string::npos
                                 ? fmt::format("{}, and so while ramping down", reason)
                                 : fmt::format("{}; while ramping down: {}", reason, why);
    trip(both);
    alarm("error", code, both, config::Action::stop);
    return;
  }
  alarm("error", code, why, config::Action::ramp_down);
  ramp_down("fail", why, After::fault);
}

void Engine::Impl::watch_exciter() {
  if (!moving() || proving) return;
  if (status && status->fault != 0 && status->t >= enabled) {
    const std::string why =
        fmt::format("the exciter tripped with fault {}; find its cause and clear it at the exciter",
                    status->fault);
    trip(why);
    alarm("error", "exciter_trip", why, config::Action::stop);
    return;
  }
  if (state == State::ramp_down) return;  // RAMP_DOWN has its own deadline
  const Nanoseconds heard = status ? std::max(status->t, enabled) : enabled;
  if (since(heard) > kExciterSilenceS) {
    return device_trouble(
        "exciter_silent",
        fmt::format("the exciter has not answered for {:.1f} s; check its power and "
                    "its link",
                    since(heard)));
  }
  if (!status || status->t < enabled + from_seconds(kReadyGraceS)) return;
  if (!status->ready) {
    return device_trouble("exciter_not_ready",
                          "the exciter is enabled and does not report ready; check its interlocks");
  }
  if (cutting() && !status->running && status->t >= entered) {
    device_trouble("exciter_stopped", "the exciter has stopped by itself; check its interlocks");
  }
}

// Compares the exciter's own report with its orders. Requires two deviations in a row, because
// a status may be read while the setpoint is being written. On the way up only too large an
// amplitude deviates.
void Engine::Impl::compare_report() {
  const bool rises =
      state == State::ramp && status && status->t >= frequency_ordered + from_seconds(kReadyGraceS);
  if (!(cutting() || rises) || proving || !status || !status->running || status->t < entered) {
    other_reports = 0;
    return;
  }
  const double part = rig.limits.command_error_fraction;
  const double most = rises ? std::max(trimmed(ramp_from), setpoint.amplitude) : setpoint.amplitude;
  std::string what;
  if (status->frequency_hz && std::abs(*status->frequency_hz - setpoint.frequency_hz) >
                                  kReportedFrequencyPart * setpoint.frequency_hz) {
    what =
        fmt::format("{:.4g} Hz, asked for {:.4g} Hz", *status->frequency_hz, setpoint.frequency_hz);
  } else if (status->amplitude &&
             (rises ? *status->amplitude > (1.0 + part) * most
                    : std::abs(*status->amplitude - order_on_the_way()) > part * most)) {
    what = fmt::format("{:.4g} m/s^2, asked for {:.4g} m/s^2", *status->amplitude, most);
  }
  other_reports = what.empty() ? 0 : other_reports + 1;
  if (other_reports < kInARow) return;
  device_trouble("exciter_disagrees",
                 fmt::format("the exciter reports {}; check its setpoint and its units", what));
}

}  // namespace shaker::daemon
