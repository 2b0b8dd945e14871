#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"

namespace shaker::daemon {

using protocol::Channel;

double Engine::Impl::ramp_s() const {
  return campaign && campaign->ramp_s > 0.0 ? campaign->ramp_s : rig.exciter.ramp_s;
}

void Engine::Impl::command(double frequency_hz, double amplitude) {
  const bool anew = !setpoint.enable || frequency_hz != setpoint.frequency_hz;
  const bool down = state == State::ramp_down && amplitude == 0.0;
  if (!row(state).setpoint_may_leave && !down) {
    return trip(
        fmt::format("internal error: a setpoint of {:g} m/s^2 in {}", amplitude, name(state)));
  }
  if (!setpoint.enable) enabled = clock.now();
  // A table that is still on the way has at most the levels of both ends.
  const bool on_the_way = setpoint.enable && since(ordered) < setpoint.ramp_s + kLagS;
  ramp_from = on_the_way ? std::max(ramp_from, asked) : asked;
  asked = std::min(amplitude, rig.limits.excitation_max_m_s2);
  setpoint = {.frequency_hz = frequency_hz,
              .amplitude = trimmed(asked),
              .enable = true,
              .ramp_s = ramp_s()};
  ordered = clock.now();
  if (anew) begin_periods();
  exciter.keep_alive(true);
  exciter.set(setpoint);
}

void Engine::Impl::halt() {
  exciter.stop();
  exciter.keep_alive(false);
  awaits_rest = awaits_rest || setpoint.enable;
  setpoint = {};
  asked = 0.0;
  stop_ordered = clock.now();
}

// --- CHECK

// The signs and the response are proved again at the gentle level.
void Engine::Impl::begin_check(const std::string& why) {
  proved = proves_deadman;  // its own level is gentle
  polarity_known = false;
  wrong_polarity = 0;
  table_is_off = false;
  reset_trim();
  detectors.reset();
  was_tripped = {};
  weak_since = {};
  rest_began = clock.now();
  for (ChannelMonitor& m : monitors)
    m.begin_rest();
  episode.clear();
  enter(State::check, why);
}

// A program that stood still longer than the exciter's dead-man does not start a table: whoever
// started the campaign may have gone near it meanwhile.
bool Engine::Impl::stood_still() {
  const double gap = since(std::max(last_tick, entered));
  const double deadman = deadman_s();
  if (moves_nothing() || !(deadman > 0.0) || !(gap > deadman)) return false;
  const std::string why = fmt::format(
      "the daemon stood still for {:.2f} s during the self check, longer than the exciter's "
      "dead-man of {:.2g} s; find out what held this PC up, and start again",
      gap, deadman);
  alarm("error", "stood_still", why);
  end_at_rest("fail", why);
  return true;
}

void Engine::Impl::tick_check() {
  if (stood_still()) return;
  if (proving) return tick_proof();
  if (since(entered) < kCheckS || since(rest_began) < kCheckS) return;
  RestFacts facts{.now = clock.now(),
                  .displacement = monitor(Channel::displacement),
                  .excitation = monitor(Channel::excitation),
                  .status = std::nullopt,
                  .sensor_trouble = sensor_health.trouble,
                  .exciter_trouble = exciter_error ? exciter_error->what : std::string(),
                  .today = format_utc(clock.utc()).substr(0, 10)};
  if (status && status->t >= entered && !exciter_error) facts.status = status;
  const auto findings = check_at_rest(rig, *campaign, facts);
  const auto fatal = std::ranges::find_if(findings, [](const Finding& f) { return f.fatal; });
  if (fatal != findings.end()) {
    if (since(entered) < kCheckGiveUpS) return wait_for_rest();  // it may still appear
    if (fatal->code == "check_noise" && since(entered) < kRestGiveUpS) return wait_for_rest();
    const std::string why = fmt::format("self check: {}", fatal->text);
    for (const auto& f : findings)
      alarm(f.fatal ? "error" : "warning", f.code, f.text);
    return end_at_rest("fail", why);
  }
  if (wants_deadman_proof() && !proves_deadman) return begin_proof_at_rest();
  for (const auto& f : findings)
    alarm("warning", f.code, f.text);
  for (const auto& [channel, label] : rig.auxiliary) {
    if (monitor(channel).rest_count() > 0) continue;
    alarm("warning", "auxiliary_silent",
          fmt::format("channel {} ({}) gives no good value; the campaign goes on without it",
                      protocol::name(channel), label.name));
  }
  rate_hz = monitor(Channel::displacement).rest_rate_hz();
  excitation_measured = monitor(Channel::excitation).rest_count() > 0;
  excitation_rate_hz = excitation_measured ? monitor(Channel::excitation).rest_rate_hz() : 0.0;
  learn_rest();
  enter(State::ramp, "the self check has passed");
  begin_ramp();
}

// A damper rings for a while after a campaign: each measurement at rest covers the last second
// only.
void Engine::Impl::wait_for_rest() {
  if (since(rest_began) < kCheckS) return;
  rest_began = clock.now();
  for (ChannelMonitor& m : monitors)
    m.begin_rest();
}

// --- RAMP

// A change of frequency starts from rest, because the behaviour of a drive between two
// frequencies is not specified.
void Engine::Impl::begin_ramp() {
  step_began = clock.now();
  if (setpoint.amplitude > 0.0 && setpoint.frequency_hz != run().frequency_hz) {
    step = RampStep::lower;
    command(setpoint.frequency_hz, 0.0);
  } else {
    begin_gentle_or_rise();
  }
}

// Another frequency of a table that is off begins at the gentle level, too, which shows how it
// answers there.
void Engine::Impl::begin_gentle_or_rise() {
  const bool known = setpoint.enable && setpoint.frequency_hz == run().frequency_hz;
  if (!known) reset_trim();
  const bool rises = proved && (known || !table_is_off);
  step = rises ? RampStep::rise : RampStep::gentle;
  command(run().frequency_hz, rises ? run().amplitude : kGentlePart * run().amplitude);
}

bool Engine::Impl::arrived() const {
  const Nanoseconds end = ordered + from_seconds(setpoint.ramp_s);
  if (clock.now() < end || !status || status->t < end) return false;
  if (status->amplitude) {
    double near = kReachedPart * (run_open || campaign ? run().amplitude : 1.0);
    // A drive may report the motion of a table that is off and will be trimmed.
    if (trims()) near = std::max(near, rig.limits.command_error_fraction * setpoint.amplitude);
    if (std::abs(*status->amplitude - setpoint.amplitude) > near) return false;
  }
  return setpoint.amplitude == 0.0 || status->running;
}

void Engine::Impl::tick_ramp() {
  if (proving) return tick_proof();
  if (step == RampStep::prove) return tick_prove();
  if (!arrived()) {
    if (since(ordered) > setpoint.ramp_s + kConfirmS) {
      device_trouble(
          "exciter_not_reached",
          fmt::format("the exciter does not confirm {:.3g} m/s^2 within {:g} s of the ramp's "
                      "end; check the drive",
                      setpoint.amplitude, kConfirmS));
    }
    return;
  }
  switch (step) {
    case RampStep::lower:
      begin_gentle_or_rise();
      break;
    case RampStep::gentle:
      step = RampStep::prove;
      step_began = clock.now();
      gentle_cycles = 0;
      deviations_seen = 0;
      restart_assembler();
      break;
    case RampStep::rise:
      if (proves_deadman) return begin_proof_in_motion();
      enter(State::settle,
            fmt::format("{:g} Hz, {:g} m/s^2 reached", run().frequency_hz, run().amplitude));
      gate.restart(static_cast<std::size_t>(campaign->points_per_cycle),
                   campaign->settle_tolerance);
      unsettled = restless = 0;
      last_why.clear();
      restart_assembler();
      break;
    case RampStep::prove:
      break;
  }
}

void Engine::Impl::tick_prove() {
  if (since(step_began) < (kGentleCyclesMax + 4) / run().frequency_hz + 1.0) return;
  if (assembler.tracker().started() && !last_why.empty()) {
    return pass_proof(Finding{true, "sensor_no_response",
                              fmt::format("no whole cycle at the gentle level: {}", last_why)});
  }
  pass_proof(check_in_motion(nullptr, setpoint.amplitude, excitation_measured, table_period));
}

void Engine::Impl::prove_cycle(const AssembledCycle& cycle) {
  last_why = cycle.why;
  if (!cycle.whole) return;
  note_deviation(cycle);
  if (++gentle_cycles < kGentleCycles) return;
  const auto finding = check_in_motion(&cycle, setpoint.amplitude, excitation_measured);
  const bool fails = finding && finding->fatal;
  if (fails && gentle_cycles < kGentleCyclesMax) return;
  if (!fails) trim_before_rise();
  pass_proof(finding);
}

void Engine::Impl::pass_proof(const std::optional<Finding>& finding) {
  collecting = false;
  if (finding && finding->fatal) {
    alarm("error", finding->code, finding->text, config::Action::ramp_down);
    return ramp_down("fail", finding->text, After::fault);
  }
  proved = true;
  // If the sign is undetermined at the gentle level, it is checked again at the full level.
  polarity_known = !finding && excitation_measured;
  begin_gentle_or_rise();
}

// --- RAMP_DOWN

// The time since which the table must rest: since the exciter reports rest or, if it reports no
// amplitude, since its delay is over. Empty while it reports motion; then kConfirmS is the
// limit.
std::optional<Nanoseconds> Engine::Impl::must_rest_since() {
  const Nanoseconds end = ordered + from_seconds(setpoint.ramp_s);
  if (!status || status->t < end) return std::nullopt;
  if (arrived() && (status->amplitude || !status->running)) {
    if (!rest_said || *rest_said < end) rest_said = status->t;
    return rest_said;
  }
  if (status->amplitude) return std::nullopt;
  return end + from_seconds(kLagS);
}

void Engine::Impl::tick_ramp_down() {
  // The exciter's report suffices only if none of our sensors observes the table. It is not waited
  // for where no sensor at all is alive: the stop that follows the ramp comes at its end.
  const Motion own = table_motion(ordered + from_seconds(setpoint.ramp_s));
  const bool blind = !table_is_seen() && !stroke_is_seen();
  if (blind ? since(ordered) >= setpoint.ramp_s
            : arrived() && (own == Motion::rests || !table_is_seen())) {
    halt();
    finish_ended_run();
    const std::string why = reason;
    enter(after_ramp_down == After::fault   ? State::fault
          : after_ramp_down == After::pause ? State::pause
                                            : State::idle,
          why);
    finish_ended_run();
    return;
  }
  const auto rests_since = must_rest_since();
  const bool denied = rests_since && table_motion(*rests_since) == Motion::moves;
  const double over = since(ordered) - setpoint.ramp_s;
  if (denied || over > kConfirmS) {
    const std::string why =
        fmt::format("{}; {} {:.1f} s after the ramp's end, and was stopped at once", reason,
                    own == Motion::moves ? "the table still moves, whatever the exciter says,"
                                         : "the exciter did not confirm zero",
                    over);
    trip(why);
    alarm("error", "ramp_down_unconfirmed", why, config::Action::stop);
  }
}

}  // namespace shaker::daemon
