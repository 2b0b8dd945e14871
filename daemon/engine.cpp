#include "daemon/engine.hpp"

#include <cmath>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"
#include "daemon/estimator_options.hpp"

namespace shaker::daemon {

using protocol::Channel;

Engine::Engine(const config::RigConfig& rig, Clock& clock, ExciterCommands& exciter,
               EstimatorCommands& estimator, Outlet& outlet)
    : impl_(std::make_unique<Impl>(rig, clock, exciter, estimator, outlet)) {
  impl_->entered = impl_->last_health = clock.now();
}
Engine::~Engine() = default;

void Engine::on_samples(std::span<const drivers::Sample> samples) {
  impl_->take(samples);
}

void Engine::on_sensor_health(const drivers::SensorHealth& health, drivers::StampSource stamps) {
  impl_->sensor_health = health;
  impl_->stamps = stamps;
}

// The age of the samples decides on the reaction: a link that recovers in time is not a fault.
void Engine::on_sensor_error(const Error& error) {
  impl_->alarm_once("sensor_link", error.what);
}

void Engine::on_exciter_status(const drivers::ExciterStatus& status) {
  impl_->status = status;
  impl_->exciter_error.reset();
  impl_->missed_answers = 0;
  impl_->compare_report();
}

void Engine::on_exciter_error(const Error& error) {
  Impl& e = *impl_;
  e.exciter_error = error;
  // A single answer may be missed, because each request is repeated. Silence has a limit of its
  // own.
  const bool missed = error.kind == ErrorKind::timeout && ++e.missed_answers < kMissedAnswers;
  if (missed && e.moving()) return e.alarm_once("exciter_missed", error.what);
  e.device_trouble("exciter_error", error.what);
}

void Engine::on_heartbeat_withheld(const std::string& why) {
  Impl& e = *impl_;
  e.trip(why);
  e.alarm("error", "heartbeat_withheld", why, config::Action::stop);
}

void Engine::on_late_heartbeat(double gap_s) {
  Impl& e = *impl_;
  if (!e.moving() || e.state == State::ramp_down || e.proving || e.moves_nothing()) return;
  const double deadman = e.deadman_s();
  if (deadman <= 0.0 || gap_s <= deadman) return;
  const std::string why = fmt::format(
      "the exciter got no heartbeat for {:.2f} s, longer than its dead-man of {:.2g} s, which has "
      "stopped the table; find out what held this PC up",
      gap_s, deadman);
  e.trip(why);
  e.alarm("error", "heartbeat_late", why, config::Action::stop);
}

void Engine::end_motion(const std::string& code, const std::string& why) {
  Impl& e = *impl_;
  if (!e.moving() || e.state == State::ramp_down) return;
  e.alarm("error", code, why, config::Action::ramp_down);
  e.ramp_down("fail", why, After::fault);
}

void Engine::on_estimate(const EstimateOutcome& outcome) {
  impl_->estimated(outcome);
}

void Engine::tick() {
  Impl& e = *impl_;
  if (auto well = e.outlet.healthy(); !well && !e.outlet_trouble) e.outlet_trouble = well.error();
  e.watch_outlet();
  e.watch_exciter();  // what the drive says of itself comes before what the sensors show of it
  e.watch_ages();
  e.watch_hold();
  switch (e.state) {
    case State::check:
      e.watch_rest();
      if (e.state == State::check) e.tick_check();
      break;
    case State::ramp:
      e.tick_ramp();
      break;
    case State::ramp_down:
      e.tick_ramp_down();
      break;
    case State::settle:
    case State::measure:
      e.finish_ended_run();
      break;
    case State::idle:
    case State::fault:
    case State::pause:
      e.finish_ended_run();
      e.watch_rest();
      e.tick_clearing();
      break;
  }
  if (e.since(e.last_health) >= 1.0) e.publish_health();
  e.last_tick = e.clock.now();
}

Result<void> Engine::Impl::admit_run(const config::RunSpec& r) const {
  const auto refuse = [&](const char* what, double value, const char* unit,
                          const std::string& why) {
    return Error{ErrorKind::invalid,
                 fmt::format("run \"{}\": {} {:g} {} {}; change the run or the rig file", r.name,
                             what, value, unit, why)};
  };
  const auto& limits = rig.limits;
  // These conditions also refuse a NaN.
  if (!(r.frequency_hz >= limits.frequency_min_hz)) {
    return refuse(
        "frequency", r.frequency_hz, "Hz",
        fmt::format("is below the rig's frequency_min_hz of {:g} Hz", limits.frequency_min_hz));
  }
  if (!(r.frequency_hz <= limits.frequency_max_hz)) {
    return refuse(
        "frequency", r.frequency_hz, "Hz",
        fmt::format("is above the rig's frequency_max_hz of {:g} Hz", limits.frequency_max_hz));
  }
  if (!(r.amplitude > 0.0)) {
    return refuse("amplitude", r.amplitude, "m/s^2", "is not above 0 m/s^2");
  }
  if (!(r.amplitude <= limits.excitation_max_m_s2)) {
    return refuse("amplitude", r.amplitude, "m/s^2",
                  fmt::format("is above the rig's excitation_max_m_s2 of {:g} m/s^2",
                              limits.excitation_max_m_s2));
  }
  if (r.cycles < 1) {
    return refuse("cycles", r.cycles, "", "is below 1");
  }
  return {};
}

// Checks levels, not crossings: a value beyond its limit before any motion is a reason to
// refuse.
Result<void> Engine::Impl::admit_levels() const {
  for (const Detector d : {Detector::stroke_limit, Detector::excitation_limit}) {
    const bool acts = detectors.action(d) >= config::Action::hold;
    if (acts && detectors.level(d).tripped) return Error{ErrorKind::refused, detectors.text(d)};
  }
  if (status && status->fault != 0) {
    return Error{
        ErrorKind::refused,
        fmt::format("the exciter reports fault {}; clear it at the exciter", status->fault)};
  }
  return {};
}

Result<void> Engine::Impl::may_start() const {
  if (state == State::fault) {
    return Error{ErrorKind::refused,
                 fmt::format("the rig is in FAULT ({}); acknowledge it first", reason)};
  }
  if (state != State::idle || campaign) {
    return Error{ErrorKind::refused, fmt::format("the rig is in {}; {}, or stop it", name(state),
                                                 state == State::pause ? "resume its campaign"
                                                                       : "wait until it is IDLE")};
  }
  return {};
}

Result<void> Engine::Impl::admit(const config::CampaignSpec& wanted) const {
  if (auto may = may_start(); !may) return may;
  if (wanted.runs.empty()) {
    return Error{ErrorKind::invalid,
                 fmt::format("campaign \"{}\" has no runs; add one", wanted.name)};
  }
  if (wanted.points_per_cycle < 8 || wanted.points_per_cycle > 4096) {
    return Error{ErrorKind::invalid,
                 fmt::format("points_per_cycle {} is not in 8..4096", wanted.points_per_cycle)};
  }
  if (!(wanted.ramp_s >= 0.0) || !(wanted.settle_tolerance > 0.0) || wanted.settle_cycles_max < 1) {
    return Error{
        ErrorKind::invalid,
        fmt::format("campaign \"{}\": ramp_s {:g} must be at least 0, settle_tolerance {:g} "
                    "above 0, settle_cycles_max {} at least 1",
                    wanted.name, wanted.ramp_s, wanted.settle_tolerance, wanted.settle_cycles_max)};
  }
  for (const auto& r : wanted.runs) {
    if (auto ok = admit_run(r); !ok) return ok;
  }
  return admit_levels();
}

Result<void> Engine::may_start() const {
  return impl_->may_start();
}
Result<void> Engine::admit(const config::CampaignSpec& wanted) const {
  return impl_->admit(wanted);
}

Result<void> Engine::prove_deadman(const config::CampaignSpec& gentle) {
  if (auto may = may_start(); !may) return may;
  impl_->proves_deadman = true;
  auto begun = start(gentle);
  if (!begun) impl_->proves_deadman = false;
  return begun;
}

std::optional<Engine::DeadmanSeen> Engine::deadman_seen() const {
  if (!impl_->deadman_proved) return std::nullopt;
  return DeadmanSeen{*impl_->deadman_proved, impl_->deadman_proved_in_motion};
}

void Engine::trust_deadman(const DeadmanSeen& seen) {
  impl_->deadman_proved = seen.seconds;
  impl_->deadman_proved_in_motion = seen.in_motion;
}

Result<void> Engine::start(const config::CampaignSpec& wanted) {
  Impl& e = *impl_;
  if (auto ok = e.admit(wanted); !ok) return ok;
  if (auto ok = e.outlet.record_campaign(wanted); !ok) return ok;
  e.campaign = wanted;
  e.recording = true;
  e.outlet_trouble.reset();
  e.outlet_trouble_told = false;
  e.furthest = 0.0;
  e.run_index = 0;
  e.run_done = false;
  e.outstanding = e.cycles_skipped = 0;
  e.set_warnings_aside();
  e.begin_check(fmt::format("campaign \"{}\" was started", wanted.name));
  if (auto ok = e.begin_run(0); !ok) {
    e.end_at_rest("fail", ok.error().what);
    return ok;
  }
  if (e.proves_deadman) return {};  // it measures no cycles
  if (const std::string text = remark(wanted); !text.empty())
    e.alarm("warning", "parameters_taken_as_one", text, config::Action::none);
  e.estimator.begin(wanted.model, estimator_options(wanted));
  return {};
}

Result<void> Engine::stop(const std::string& who) {
  Impl& e = *impl_;
  const std::string why = fmt::format("stopped by {}", who);
  if (e.state == State::check || e.state == State::pause) {
    e.end_at_rest("abort", why);
  } else if (e.moving()) {
    e.ramp_down("abort", why, After::idle);
  }
  return {};  // nothing moves, or it already ramps down: a second stop is no error
}

Result<void> Engine::emergency_stop(const std::string& who) {
  Impl& e = *impl_;
  const std::string why = fmt::format("emergency stop by {}", who);
  e.fault_detector.reset();
  e.trip(why);  // stops the exciter before anything else
  e.alarm("error", "emergency_stop", why, config::Action::stop);
  return {};
}

Result<void> Engine::Impl::cause_persists() const {
  const auto no = [](const std::string& why) {
    return Error{ErrorKind::refused, fmt::format("not acknowledged: {}", why)};
  };
  if (!status || since(status->t) > kExciterSilenceS) {
    return no("the exciter does not answer, so nobody knows whether it stands still");
  }
  // A report from before the link failed does not describe the present.
  if (exciter_error) {
    return no(exciter_error->what + "; so nobody knows whether the exciter stands still");
  }
  if (status->running) return no("the exciter still reports motion; stop it at the exciter");
  if (awaits_rest && may_move_told > 0) {
    return no("nobody has seen the table at rest since it was told to stop; use the hardware stop");
  }
  if (status->fault != 0) {
    return no(fmt::format("the exciter reports fault {}; clear it at the exciter", status->fault));
  }
  if (fault_detector && detectors.level(*fault_detector).tripped) {
    return no(detectors.text(*fault_detector));
  }
  return {};
}

// Only an exciter that reports standstill may be told to clear its fault.
bool Engine::Impl::may_clear() const {
  return status && since(status->t) <= kExciterSilenceS && !exciter_error && !status->running &&
         status->fault != 0;
}

void Engine::Impl::leave_fault(const std::string& who) {
  clearing.reset();
  if (ending) ending->deadline = clock.now();
  finish_ended_run();
  fault_detector.reset();
  enter(State::idle, fmt::format("acknowledged by {}", who));
  acknowledge_alarms(who);
}

void Engine::Impl::tick_clearing() {
  if (!clearing) return;
  if (state != State::fault) return clearing.reset();
  if (status && status->t > clearing->ordered && cause_persists()) {
    return leave_fault(std::string(clearing->who));
  }
  if (since(clearing->ordered) < kClearS) return;
  clearing.reset();
  alarm("error", "fault_stays",
        fmt::format("the exciter was told to clear its fault, and reports fault {} after {:g} s; "
                    "remove its cause, or clear it at the exciter",
                    status ? status->fault : 0, kClearS));
}

Result<void> Engine::acknowledge(const std::string& who) {
  Impl& e = *impl_;
  if (e.state != State::fault && e.standing_errors + e.standing_warnings == 0) {
    return Error{ErrorKind::refused,
                 fmt::format("there is no fault to acknowledge, and no alarm; the rig is in {}",
                             name(e.state))};
  }
  if (e.state != State::fault) {
    e.acknowledge_alarms(who);
    return {};
  }
  if (e.clearing) return {};
  if (e.may_clear()) {
    e.clearing = Impl::Clearing{who, e.clock.now()};
    e.exciter.clear_fault();
    return {};
  }
  if (auto gone = e.cause_persists(); !gone) return gone;
  e.leave_fault(who);
  return {};
}

void Engine::lease_lost() {
  Impl& e = *impl_;
  e.controlled = false;
  const std::string why = "the controlling client is gone (its lease ran out)";
  if (e.state == State::pause || e.pausing()) {
    e.alarm("warning", "lease_lost",
            why + "; the campaign stays paused until a client takes control and resumes it",
            config::Action::none);
    return;
  }
  if (e.resting() || e.state == State::ramp_down) return;
  e.alarm("warning", "lease_lost", why, config::Action::ramp_down);
  if (e.state == State::check) {
    e.end_at_rest("abort", why);
  } else {
    e.ramp_down("abort", why, After::idle);
  }
}

void Engine::set_controlled(bool controlled) {
  impl_->controlled = controlled;
}
void Engine::set_client_count(int clients) {
  impl_->clients = clients;
}
void Engine::publish(const protocol::Document& document) {
  impl_->publish(document);
}
State Engine::state() const {
  return impl_->state;
}
double Engine::ramp_s() const {
  return impl_->ramp_s();
}
protocol::StateDocument Engine::state_document() const {
  return impl_->state_document();
}

}  // namespace shaker::daemon
