#include <algorithm>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"

namespace shaker::daemon {

void Engine::Impl::enter(State to, const std::string& why) {
  if (!allowed(state, to)) {
    // A programming error must not endanger the rig.
    halt();
    reason = fmt::format("internal error: {} may not lead to {} ({})", name(state), name(to), why);
    state = State::fault;
  } else {
    state = to;
    reason = why;
  }
  entered = clock.now();
  if (!cutting()) {
    collecting = false;
    // These detectors need whole cycles or motion, so their levels end here.
    for (const Detector d :
         {Detector::frozen_sensor, Detector::response_change, Detector::under_peak}) {
      detectors.report(d, {});
    }
    under_peaks = response_changes = 0;
  }
  if (!moving()) {
    detectors.report(Detector::command_error, {});
    command_errors = 0;
  }
  if (state == State::idle) episode.clear();
  if (campaign) furthest = std::max(furthest, done_s());
  publish(state_document());
}

void Engine::Impl::ramp_down(const std::string& outcome, const std::string& why, After then) {
  if (pausing()) return end_instead_of_pausing(outcome, why, then);
  if (state == State::ramp_down) {
    if (then == After::fault) after_ramp_down = then;
    return;
  }
  if (!allowed(state, State::ramp_down)) return;
  proving.reset();
  after_ramp_down = then;
  enter(State::ramp_down, why);
  end_run(outcome, why);
  command(setpoint.frequency_hz, 0.0);
}

void Engine::Impl::trip(const std::string& why) {
  proving.reset();
  halt();
  if (state == State::fault) return;
  enter(State::fault, why);
  end_run("fail", why);  // published at the next tick, after the cycle that tripped it
}

// Sets the outcome of the run. It is published once the run's estimates have arrived or have
// timed out.
void Engine::Impl::end_run(const std::string& outcome, const std::string& why) {
  if (!run_open || ending) return;
  held_by.clear();
  run_done = cutting();  // a stop, a trip or a failed CHECK has left these states before
  ending = RunEnd{outcome, why, clock.now() + from_seconds(kEstimateGiveUpS)};
}

void Engine::Impl::finish_ended_run() {
  if (ending) {
    if (outstanding > 0 && clock.now() < ending->deadline) return;
    if (outstanding > 0) {
      alarm("warning", "estimator_slow",
            fmt::format("{} estimates of run \"{}\" did not come in {:g} s; its cycles are on disk",
                        outstanding, run().name, kEstimateGiveUpS));
      outstanding = 0;
    }
    publish(protocol::RunStopDocument{.campaign = campaign->name,
                                      .run = run().name,
                                      .status = ending->status,
                                      .reason = ending->reason,
                                      .cycles_accepted = run_accepted,
                                      .cycles_rejected = run_rejected,
                                      .noise = cycle_noise()});
    ending.reset();
    run_open = false;
  }
  if (!campaign || run_open) return;
  if (cutting()) {
    next_run_or_end();
  } else if (state == State::idle || state == State::fault) {
    close_campaign();
  }
}

void Engine::Impl::close_campaign() {
  if (!campaign) return;
  outlet.close_campaign();
  recording = false;
  proves_deadman = false;
  campaign.reset();
}

void Engine::Impl::next_run_or_end() {
  if (run_index + 1 == campaign->runs.size()) {
    after_ramp_down = After::idle;
    enter(State::ramp_down, fmt::format("campaign \"{}\" is complete", campaign->name));
    command(setpoint.frequency_hz, 0.0);
    return;
  }
  const std::string why = fmt::format("run \"{}\" is over", run().name);
  keep(begin_run(run_index + 1));
  enter(State::ramp, why);
  begin_ramp();
}

Result<void> Engine::Impl::begin_run(std::size_t index) {
  run_index = index;
  run_cycles = run_accepted = run_rejected = unsettled = 0;
  creeping = 0;
  restless = command_errors = under_peaks = 0;
  response.reset();
  largest_stroke = 0.0;
  trim_limited = false;
  deviations_seen = 0;
  ending.reset();
  noise.restart(static_cast<std::size_t>(campaign->points_per_cycle));
  const auto recorded = outlet.record_run(static_cast<int>(index), run());
  run_open = true;
  run_done = false;
  publish(protocol::RunStartDocument{.campaign = campaign->name,
                                     .run = run().name,
                                     .run_index = static_cast<int>(index),
                                     .run_count = static_cast<int>(campaign->runs.size()),
                                     .frequency_hz = run().frequency_hz,
                                     .amplitude = run().amplitude,
                                     .cycles_wanted = run().cycles});
  return recorded;
}

// Only stores the error; watch_outlet reacts to it. Thus a call in the middle of a transition
// does not start another transition.
bool Engine::Impl::keep(const Result<void>& recorded) {
  if (!recorded && recording && !outlet_trouble) outlet_trouble = recorded.error();
  return recorded.ok();
}

// Data that cannot be kept must not be measured. Raises one alarm in each campaign.
void Engine::Impl::watch_outlet() {
  if (!outlet_trouble || outlet_trouble_told) return;
  outlet_trouble_told = true;
  recording = false;
  const std::string why = fmt::format("nothing can be recorded: {}", outlet_trouble->what);
  const bool in_motion = moving() && (state != State::ramp_down || pausing());
  alarm("error", "recording_failed", why,
        in_motion ? config::Action::ramp_down : config::Action::indicate);
  if (state == State::check || state == State::pause) {
    end_at_rest("fail", why);
  } else if (in_motion) {
    ramp_down("fail", why, After::idle);
  }
}

// Nothing has moved, so no fault is latched.
void Engine::Impl::end_at_rest(const std::string& outcome, const std::string& why) {
  if (std::exchange(proving, std::nullopt)) halt();
  end_run(outcome, why);
  finish_ended_run();
  enter(State::idle, why);
  finish_ended_run();
}

void Engine::Impl::act(Detector detector) {
  const config::Action action = detectors.action(detector);
  if (action == config::Action::none) return;
  detector_alarm(detector, action);
  if (action == config::Action::indicate) return;
  const std::string why = detectors.text(detector);
  if (state == State::check) {
    end_at_rest("fail", why);
    return;
  }
  // A ramp down that the table does not follow, or that a sensor no longer shows, is not waited for.
  const bool astray = state == State::ramp_down &&
                      (detector == Detector::stale_sensor || detector == Detector::command_error);
  if (action == config::Action::stop || astray) {
    fault_detector = detector;
    trip(why);
  } else if (action == config::Action::hold && cutting()) {
    gate.begin_anew();
    if (held_by.empty()) held_since = clock.now();
    held_by = why;
  } else if (state != State::ramp_down || pausing()) {
    // A ramp is not held half way, because nobody ordered that level.
    fault_detector = detector;
    ramp_down("fail", why, After::fault);
  }
}

}  // namespace shaker::daemon
