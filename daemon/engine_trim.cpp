// Trims the order to the exciter, so that the table's measured amplitude becomes the one that the
// run asks for.
//
// Integral control: once three cycles that lie whole behind the last order agree, the order is
// multiplied by asked over measured, with the smallest of their deviations: late time stamps may
// disturb a single cycle. The correction is bounded by trim_max_fraction and excitation_max_m_s2, and goes
// along the exciter's own ramp. A cycle that is further off than kTrimTolerance is not accepted.
// The detectors compare the table with what is asked for, not with the corrected order; a deviation
// of more than command_error_fraction is theirs and is not corrected. Before the full level of a
// table that is off, its answer is measured at the gentle level. Off where the excitation is not
// measured.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"

namespace shaker::daemon {
namespace {

constexpr double kTrimTolerance = 0.01;  // of the amplitude that is asked for
constexpr double kTrimDead = 2e-3;       // smaller ones are left: an amplitude register has steps
constexpr double kTrimSigmas = 5.0;      // and those that noise may explain

}  // namespace

bool Engine::Impl::trims() const {
  return excitation_measured && rig.limits.trim_max_fraction > 0.0 && !moves_nothing() &&
         !proves_deadman;
}

double Engine::Impl::trimmed(double amplitude) const {
  return std::min(amplitude * trim_part, rig.limits.excitation_max_m_s2);
}

// The order as the ramp of a correction has it by now.
double Engine::Impl::order_on_the_way() const {
  if (trim_ordered <= ordered || setpoint.ramp_s <= 0.0) return setpoint.amplitude;
  const double part = std::min(1.0, since(trim_ordered) / setpoint.ramp_s);
  return trim_from + part * (setpoint.amplitude - trim_from);
}

void Engine::Impl::reset_trim() {
  trim_part = 1.0;
  deviations_seen = 0;
  trim_limited = false;
}

// Sets the part for a table that answers `measured` to the present order. Returns false if the
// bound does not allow it.
bool Engine::Impl::correct_for(double measured) {
  const double wanted = setpoint.amplitude / measured;
  const double most = 1.0 + rig.limits.trim_max_fraction;
  trim_part = std::clamp(wanted, 1.0 / most, most);
  return trim_part == wanted && trimmed(run().amplitude) == run().amplitude * trim_part;
}

void Engine::Impl::say_trimmed(double measured) {
  alarm("info", "amplitude_trimmed",
        fmt::format("the table moves with {:.4g} m/s^2 where {:.4g} m/s^2 is asked for; ordered is "
                    "now {:.4g} times that",
                    measured, asked, trim_part));
}

void Engine::Impl::note_deviation(const AssembledCycle& cycle) {
  deviations[deviations_seen++ % deviations.size()] = cycle.measured.amplitude / asked - 1.0;
}

// The smallest of the last deviations if they have one sign; 0 if they have not, or are too few.
double Engine::Impl::agreed_deviation() const {
  if (deviations_seen < deviations.size()) return 0.0;
  const auto [low, high] = std::ranges::minmax(deviations);
  return low > 0.0 ? low : std::min(high, 0.0);
}

// At the gentle level, before the rise.
void Engine::Impl::trim_before_rise() {
  const double deviation = agreed_deviation(), off = std::abs(deviation);
  deviations_seen = 0;
  if (!trims() || off <= kTrimTolerance || off > rig.limits.command_error_fraction) return;
  table_is_off = true;
  const double measured = asked * (1.0 + deviation);
  correct_for(measured);
  say_trimmed(measured);
}

// Returns why the cycle cannot be accepted; empty if its amplitude is right, or as near to it as
// the bounds allow.
std::string Engine::Impl::trim(const AssembledCycle& cycle) {
  if (!trims()) return {};
  const double measured = cycle.measured.amplitude;
  const double scatter = kTrimSigmas * cycle.measured.excitation_error / asked;
  const double off = std::abs(measured / asked - 1.0);
  if (off > rig.limits.command_error_fraction) {
    deviations_seen = 0;
    return {};
  }
  const bool far = off > std::max(kTrimTolerance, scatter);
  const Nanoseconds last = std::max(ordered, trim_ordered);
  const bool answers_order = cycle.begin >= last + from_seconds(setpoint.ramp_s + kLagS);
  if (answers_order) {
    note_deviation(cycle);
    const double agreed = agreed_deviation();
    if (std::abs(agreed) > std::max(kTrimDead, scatter))
      order_correction(asked * (1.0 + agreed),
                       std::abs(agreed) > std::max(kTrimTolerance, scatter));
  }
  if (!far || trim_limited) return {};
  return fmt::format("trimming: the table moves with {:.4g} m/s^2, asked for {:.4g}", measured,
                     asked);
}

void Engine::Impl::order_correction(double measured, bool far) {
  const bool reachable = correct_for(measured);
  if (far) table_is_off = true;
  if (far && !reachable && !std::exchange(trim_limited, true)) {
    alarm(
        "warning", "trim_limited",
        fmt::format("the table moves with {:.4g} m/s^2 where {:.4g} m/s^2 is asked for, and the "
                    "order may not be corrected further (trim_max_fraction {:g}, "
                    "excitation_max_m_s2 {:g}); check the exciter's tuning and the "
                    "accelerometer's scale",
                    measured, asked, rig.limits.trim_max_fraction, rig.limits.excitation_max_m_s2));
  }
  if (reachable) trim_limited = false;
  const double amplitude = trimmed(asked);
  if (std::abs(amplitude - setpoint.amplitude) < kTrimDead * asked) return;
  if (far && reachable) say_trimmed(measured);
  if (far) gate.begin_anew();
  deviations_seen = 0;
  trim_from = setpoint.amplitude;
  setpoint.amplitude = amplitude;
  corrected_to = amplitude;
  trim_ordered = clock.now();
  exciter.set(setpoint);
}

}  // namespace shaker::daemon
