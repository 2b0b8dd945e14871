// Supervision of the motion, period by period of the setpoint: does the table do what is commanded,
// and does the stroke answer as before.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "daemon/engine_impl.hpp"

namespace shaker::daemon {
namespace {

using protocol::Channel;

constexpr int kPeriodsInARow = 2;         // one may be disturbed
constexpr double kAmplitudeFloor = 0.01;  // of the run's amplitude: the least tolerance
constexpr double kMovingPart = 0.02;      // of the run's amplitude: less does not tell a frequency
constexpr double kReferencePart = 0.2;    // weight of a new period in the reference response
constexpr double kVanished = 3.0;         // times the amplitude that noise alone causes
constexpr double kSlowPeriods = 10.0;     // a ramp of so many changes an answer little by little
constexpr int kMixedPeriods = 1;          // a jump within a period shows half in it
// Of the change that is a jump: periods that are alike. A free oscillation changes the answer by equal
// steps, so that three of them are no jump.
constexpr double kAlikePart = 1.0 / 3.0;

}  // namespace

void Engine::Impl::begin_periods() {
  for (PeriodWatch& watch : periods)
    watch.restart(setpoint.frequency_hz, clock.now());
  frequency.restart(setpoint.frequency_hz, clock.now());
  frequency_ordered = clock.now();
  table_period.reset();
  unpaired = {};
  command_errors = response_changes = 0;
  recent_answer.reset();
  alike_answer.reset();
}

void Engine::Impl::watch_period(Channel channel, Nanoseconds t, double value) {
  if (channel == Channel::excitation) watch_frequency(t, value);
  const auto figures = periods[static_cast<std::size_t>(channel)].add(t, value);
  if (!figures || !moving()) return;
  const double rate = channel == Channel::excitation ? excitation_rate_hz : rate_hz;
  if (!figures->filled(rate)) return;
  const bool whole = figures->whole(rate);
  if (channel == Channel::excitation) {
    table_period = figures;
    judge_command(*figures);
  } else if (judge_alone(*figures, whole)) {
    return;
  }
  if (!whole) return;
  // The two sensors may be late by different times. The table of another period would not do: its
  // phase is another one where stamps or the table itself were late meanwhile.
  const auto slot = static_cast<std::size_t>(figures->index) % unpaired[0].size();
  unpaired[static_cast<std::size_t>(channel)][slot] = *figures;
  PeriodFigures& stroke = unpaired[static_cast<std::size_t>(Channel::displacement)][slot];
  PeriodFigures& table = unpaired[static_cast<std::size_t>(Channel::excitation)][slot];
  if (stroke.samples == 0 || table.samples == 0 || stroke.index != table.index) return;
  const PeriodFigures period = std::exchange(stroke, {});
  const std::complex<double> moved = std::exchange(table, {}).fundamental;
  // What a stroke answers to another frequency is no fault of the stroke.
  if (std::abs(moved) > 0.0 && !frequency.suspects())
    judge_response(period, period.fundamental / moved, false);
}

// A table that comes to rest rings at a frequency of its own.
void Engine::Impl::watch_frequency(Nanoseconds t, double value) {
  if (!moving() || state == State::ramp_down || proving || !(excitation_rate_hz > 0.0))
    return frequency.forget();
  frequency.add(t, value,
                {.least = kMovingPart * run().amplitude,
                 .noise = table_noise,
                 .rate_hz = excitation_rate_hz});
  if (!frequency.differs() || detectors.level(Detector::command_error).tripped) return;
  detectors.report(Detector::command_error, {.tripped = true,
                                             .of_frequency = true,
                                             .value = frequency.frequency_hz(),
                                             .limit = setpoint.frequency_hz,
                                             .channel = Channel::excitation});
  watch_levels();
}

// Excess amplitude is judged in every state; a deficit only in SETTLE and MEASURE, once the
// ramp is over. A trimmed order is judged by what is asked for. Whether a ramp down ends at rest is
// judged by tick_ramp_down: a table rings.
void Engine::Impl::judge_command(const PeriodFigures& period) {
  const Nanoseconds ramped = ordered + from_seconds(setpoint.ramp_s + kLagS);
  const bool reached = period.begin >= ramped && state != State::ramp_down;
  const double most = reached ? asked : std::max(ramp_from, asked);
  const double still = std::numbers::sqrt2 * table_noise;
  const double all = std::sqrt(std::max(0.0, period.all * period.all - still * still));
  const double floor = kAmplitudeFloor * run().amplitude + 5.0 * still / std::sqrt(period.samples);
  const double part = rig.limits.command_error_fraction;
  const double amplitude = std::abs(period.fundamental);
  const bool over = all > (1.0 + part) * most + floor;
  const bool under = reached && cutting() && amplitude < (1.0 - part) * most - floor;
  command_errors = over || under ? command_errors + 1 : 0;
  const bool elsewhere = !over && frequency.suspects();
  detectors.report(Detector::command_error,
                   {.tripped = command_errors >= kPeriodsInARow || frequency.differs(),
                    .weak = !over && !frequency.differs(),
                    .of_frequency = elsewhere,
                    .value = over        ? all
                             : elsewhere ? frequency.frequency_hz()
                                         : amplitude,
                    .limit = elsewhere ? setpoint.frequency_hz : asked,
                    .channel = Channel::excitation});
  watch_levels();
}

// A stroke that has vanished is seen at once, whatever the table does and whatever samples are
// missing. Returns false if the stroke must wait for the table's figures.
bool Engine::Impl::judge_alone(const PeriodFigures& stroke, bool whole) {
  const double still = stroke_noise * std::sqrt(2.0 / stroke.samples);
  const bool vanished = std::abs(stroke.fundamental) <= kVanished * still;
  if (!vanished && excitation_measured) return false;
  if (vanished || whole) judge_response(stroke, stroke.fundamental, vanished);
  return true;
}

// The response of the stroke, relative to the table's motion in the same period if that is
// measured, must not jump from one period to the next. A slow change comes from the damper; a jump
// is a fault. A period with a gap in its samples is not compared: it neither adds to the periods
// in a row nor ends them.
//
// The reference is the mean of the periods since the run became steady. Before, it is the last
// period that was like the one before it: transients and slow ramps change the answer little by
// little.
void Engine::Impl::judge_response(const PeriodFigures& period, std::complex<double> answer,
                                  bool vanished) {
  const bool level = period.begin >= ordered + from_seconds(setpoint.ramp_s + kLagS);
  const bool rises = state == State::ramp && step != RampStep::lower &&
                     (level || setpoint.ramp_s * setpoint.frequency_hz >= kSlowPeriods);
  if (!rises && !(cutting() && level)) {
    response_changes = 0;
    recent_answer.reset();
    alike_answer.reset();
    return;
  }
  const double jump = rig.limits.response_change_fraction;
  const auto reference = cutting() && response ? response : alike_answer;
  bool changed = vanished && (cutting() || reference);
  if (reference && !vanished) {
    // A damper may break loose on the way up.
    const bool grows = !cutting() && (answer / *reference).real() > 1.0;
    changed = !grows && std::abs(answer - *reference) > jump * std::abs(*reference);
  }
  response_changes = changed ? response_changes + 1 : 0;
  if (!changed && !vanished) {
    const bool alike = recent_answer && std::abs(answer - *recent_answer) <=
                                            kAlikePart * jump * std::abs(*recent_answer);
    alike_age = alike ? 0 : alike_age + 1;
    if (alike) alike_answer = answer;
    if (alike_age > kMixedPeriods) alike_answer.reset();
    if (response) *response += kReferencePart * (answer - *response);
  }
  if (!vanished) recent_answer = last_answer = answer;
  detectors.report(Detector::response_change,
                   {.tripped = response_changes >= kPeriodsInARow,
                    .weak = vanished,
                    .value = reference && !vanished ? std::abs(answer / *reference) : 0.0,
                    .limit = jump,
                    .channel = Channel::displacement});
  watch_levels();
}

}  // namespace shaker::daemon
