#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"
#include "estimator/online/change_watch.hpp"
#include "report/estimate_document.hpp"

namespace shaker::daemon {

using protocol::Channel;
namespace {

constexpr double kSteadyChange = 3.0;  // change between cycles over the noise: a campaign's default
constexpr int kWrongInARow = 2;
constexpr int kWildInARow = 2;

}  // namespace

// Checks limits first, then records, then cuts cycles. Per sample, unless a limit trips: no
// allocation, no clock, no call to another component.
void Engine::Impl::take(std::span<const drivers::Sample> samples) {
  for (const auto& sample : samples) {
    if (!monitor(sample.channel).add(sample)) continue;
    if (detectors.sample(sample.channel, sample.t, sample.value)) watch_levels();
    if (is_watched(sample.channel)) {
      rest(sample.channel).add(sample.t, sample.value);
      if (setpoint.enable) watch_period(sample.channel, sample.t, sample.value);
    }
    if (collecting) assembler.push(sample.channel, sample.t, sample.value);
  }
  watch_levels();
  if (recording && state != State::pause) keep(outlet.record_samples(samples));
  watch_outlet();
  collect();
  watch_outlet();
}

void Engine::Impl::restart_assembler() {
  assembler.restart({.points = campaign->points_per_cycle,
                     .nominal_hz = run().frequency_hz,
                     .sample_rate_hz = rate_hz,
                     .excitation_rate_hz = std::max(rate_hz, excitation_rate_hz),
                     .excitation_measured = excitation_measured},
                    clock.now());
  collecting = true;
}

void Engine::Impl::collect() {
  while (collecting) {
    const AssembledCycle* cycle = assembler.poll();
    if (cycle == nullptr) return;
    on_cycle(*cycle);
  }
}

void Engine::Impl::on_cycle(const AssembledCycle& cycle) {
  if (state == State::ramp && step == RampStep::prove) return prove_cycle(cycle);
  if (!cutting() || ending) return;
  corrected_to.reset();
  order_of_cycle = trims() ? std::optional(setpoint.amplitude) : std::nullopt;
  GateVerdict verdict;
  const bool spiked = cycle.whole && (cycle.stroke_max > rig.limits.stroke_max_m ||
                                      cycle.stroke_min < rig.limits.stroke_min_m);
  if (spiked) {
    gate.interrupt();
    verdict.why = fmt::format(
        "a stroke of {:.4g} m lies outside the limits for a moment",
        cycle.stroke_max > rig.limits.stroke_max_m ? cycle.stroke_max : cycle.stroke_min);
  } else if (cycle.whole) {
    verdict = gate.add(cycle.measured.displacement, cycle.point_noise);
    sensor_noise = cycle.point_noise;
  } else {
    gate.interrupt();
    verdict.why = cycle.why;
  }
  // A single sample beyond the limits is tolerated; one in each of two cycles in a row is not.
  spiked_cycles = spiked ? spiked_cycles + 1 : 0;
  if (spiked_cycles >= kWildInARow) {
    detectors.report(
        Detector::stroke_limit,
        {.tripped = true,
         .value = cycle.stroke_max > rig.limits.stroke_max_m ? cycle.stroke_max : cycle.stroke_min,
         .limit = rig.limits.stroke_max_m});
    watch_levels();
  }
  watch_cycle(cycle);
  if (!cutting()) return reject(cycle, verdict, reason);
  if (!held_by.empty()) {
    gate.begin_anew();
    return reject(cycle, verdict, "held: " + held_by);
  }
  if (cycle.whole && !spiked) {
    if (const std::string off = trim(cycle); !off.empty()) return reject(cycle, verdict, off);
  }
  if (!cycle.whole || spiked || !(verdict.steady || damper_changes(verdict)))
    return reject(cycle, verdict, verdict.why);
  if (!right_polarity(cycle, verdict)) return reject(cycle, verdict, reason);
  if (state == State::settle) steady_begins();
  if (state != State::measure) return reject(cycle, verdict, reason);
  accept(cycle, verdict);
}

// Decides whether a drift comes from the damper. A campaign with change detection needs the
// cycles in which the damper changes, and a damper that warms up drifts. In MEASURE every drift
// is the damper. In SETTLE it may be a transient, which decays; a drift that does not decay is
// the damper too.
bool Engine::Impl::damper_changes(const GateVerdict& verdict) {
  if (!campaign->change_detection || verdict.creep == 0.0) {
    creeping = 0;
    return false;
  }
  if (state == State::measure) return true;
  if (creeping++ == 0) creep_began = verdict.creep;
  if (creeping < kCreepCycles) return false;
  creeping = 0;
  if (verdict.creep < 0.5 * creep_began) return false;
  alarm(
      "warning", "creeping",
      fmt::format("the stroke goes on creeping, by {:.1f} times the noise over {} cycles, and not "
                  "as a transient that dies: the damper changes while it is measured (it warms "
                  "up, leaks); let it rest or warm through if that is not what you want to see",
                  verdict.creep, SteadyGate::kWindow));
  return true;
}

// Detectors that need a whole period.
void Engine::Impl::watch_cycle(const AssembledCycle& cycle) {
  const double commanded = run().amplitude;
  double peak = cycle.measured.amplitude, wanted = commanded;
  if (!excitation_measured) {
    if (!cycle.whole) return;
    peak = (cycle.stroke_max - cycle.stroke_min) / 2.0;
    largest_stroke = std::max(largest_stroke, peak);
    wanted = largest_stroke;
  }
  wanted *= rig.limits.under_peak_fraction;
  under_peaks = peak < wanted ? under_peaks + 1 : 0;
  detectors.report(Detector::under_peak,
                   {.tripped = under_peaks >= 2,
                    .weak = true,
                    .value = peak,
                    .limit = wanted,
                    .channel = excitation_measured ? Channel::excitation : Channel::displacement});
  watch_levels();
}

// Checks the polarity on cycles that really repeat, however large the campaign's tolerance is:
// the phase of the stroke wanders during a transient. Returns false if the rig ramps down.
bool Engine::Impl::right_polarity(const AssembledCycle& cycle, const GateVerdict& verdict) {
  if (!excitation_measured || polarity_known || verdict.change > kSteadyChange) return true;
  const Polarity seen = polarity(cycle.lag_turns);
  wrong_polarity = seen == Polarity::wrong ? wrong_polarity + 1 : 0;
  if (seen == Polarity::wrong && wrong_polarity < kWrongInARow) return true;
  polarity_known = true;
  if (seen == Polarity::right) return true;
  const Finding finding = polarity_finding(cycle.lag_turns);
  alarm(finding.fatal ? "error" : "warning", finding.code, finding.text);
  if (finding.fatal) ramp_down("fail", finding.text, After::fault);
  return !finding.fatal;
}

void Engine::Impl::steady_begins() {
  if (!response) response = last_answer;
  enter(State::measure, fmt::format("steady after {} cycles", unsettled));
  unsettled = restless = 0;
}

void Engine::Impl::accept(const AssembledCycle& cycle, const GateVerdict& verdict) {
  outgoing = cycle.measured;
  outgoing.run = static_cast<int>(run_index);
  outgoing.index = run_cycles;
  // Without an accelerometer the command is the best that is known; a warning says so.
  if (!excitation_measured) outgoing.amplitude = run().amplitude;
  if (!recording) return;
  if (!keep(outlet.record_cycle(outgoing, true))) return;
  publish_cycle(cycle, true, "", verdict);
  ++run_cycles;
  ++run_accepted;
  unsettled = restless = 0;
  noise.add(outgoing.displacement);
  ++outstanding;
  if (measured()) {
    end_run("success",
            fmt::format("{} cycles; {}", run_accepted, repeatability(noise, sensor_noise)));
  }
  estimator.add(outgoing, cycle.last_sample);  // last, because the answer may come at once
}

void Engine::Impl::reject(const AssembledCycle& cycle, const GateVerdict& verdict,
                          const std::string& why) {
  if (cycle.whole && recording) {
    outgoing = cycle.measured;
    outgoing.run = static_cast<int>(run_index);
    outgoing.index = run_cycles;
    keep(outlet.record_cycle(outgoing, false));
  }
  publish_cycle(cycle, false, why, verdict);
  ++run_cycles;
  ++run_rejected;
  if (!cutting()) return;
  last_why = why;
  if (state == State::measure && ++restless >= kRestlessCycles) {
    enter(State::settle, fmt::format("no longer steady: {}", why));
    restless = 0;
  }
  if (++unsettled >= campaign->settle_cycles_max) {
    const std::string text = fmt::format("no steady state after {} cycles: {}", unsettled, why);
    alarm("warning", "no_steady_state", text);
    end_run("fail", text);
  }
}

// Publishes the most likely change first, then the parameters that would look alike or, if no
// single one explains the change, that also raised an alarm.
void Engine::Impl::changed(const std::vector<estimator::ParameterChange>& changes) {
  if (changes.empty()) return;
  const estimator::ParameterChange& change = changes.front();
  protocol::AlarmDocument document;
  document.severity = "warning";
  document.code = "parameter_change";
  document.text = estimator::online::sentence(changes);
  document.action = std::string(name(config::Action::indicate));
  document.value = change.jump;
  document.standard_error = change.standard_error;
  document.parameter = change.name;
  document.alone = change.alone;
  for (std::size_t i = 1; i < changes.size(); ++i)
    document.alternatives.push_back(changes[i].name);
  const auto index = static_cast<std::size_t>(std::max(0, change.run));
  if (index < campaign->runs.size()) document.run = campaign->runs[index].name;
  document.cycle = change.cycle;
  publish(document);
}

void Engine::Impl::estimated(const EstimateOutcome& outcome) {
  if (!campaign) return;
  const long answered = 1 + outcome.cycles_skipped;
  outstanding = std::max(0L, outstanding - answered);
  cycles_skipped += outcome.cycles_skipped;
  protocol::EstimateDocument document;
  if (outcome.estimate) {
    document = report::to_document(*outcome.estimate);
    changed(outcome.estimate->changes);
  } else {
    document.model = campaign->model.name;
    document.usable = document.converged = false;
    document.warnings.push_back(fmt::format("no estimate: {}", outcome.estimate.error().what));
  }
  const auto index = static_cast<std::size_t>(std::max(0, outcome.run));
  if (index < campaign->runs.size()) document.run = campaign->runs[index].name;
  document.campaign = campaign->name;
  document.cycle = outcome.cycle;
  document.cycles_skipped = outcome.cycles_skipped;
  document.clock = std::string(drivers::name(stamps));
  document.latency_s = since(outcome.last_sample);
  if (outcome.cycles_skipped > 0) {
    document.warnings.push_back(
        fmt::format("the estimator was too slow and skipped {} cycles; they are on disk",
                    outcome.cycles_skipped));
  }
  if (!excitation_measured) {
    document.warnings.push_back(
        "the excitation was not measured: tau = 0 follows the command, and damping is biased by "
        "the drive's delay");
  }
  publish(document);
}

}  // namespace shaker::daemon
