// A pause: the rig ramps to rest and the campaign stays open. Nothing moves until a client in
// control resumes it; the resumed campaign passes CHECK and the gentle level again.
#include <fmt/format.h>

#include "daemon/engine_impl.hpp"

namespace shaker::daemon {
namespace {

Error refused_in(State state, const std::string& what) {
  return {ErrorKind::refused, fmt::format("the rig is in {}; {}", name(state), what)};
}

}  // namespace

bool Engine::Impl::pausing() const {
  return state == State::ramp_down && after_ramp_down == After::pause;
}

// The rig will be at rest, or is. Something else than a resumption ends the campaign there.
void Engine::Impl::end_instead_of_pausing(const std::string& outcome, const std::string& why,
                                          After then) {
  after_ramp_down = then;
  reason = why;
  end_run(outcome, why);
  publish(state_document());
}

// Nothing can have moved the table since the pause began, but sensors, drive and damper may have
// been touched: the checks of a start are repeated.
void Engine::Impl::resume(const std::string& why) {
  const bool next = !run_open;
  begin_check(why);
  if (next) {
    keep(begin_run(run_index + 1));
  } else {
    unsettled = restless = under_peaks = creeping = 0;
    response.reset();
  }
}

Result<void> Engine::pause(const std::string& who) {
  Impl& e = *impl_;
  if (e.state == State::pause || e.pausing()) return {};  // a second pause is no error
  if (e.proves_deadman) return refused_in(e.state, "a proof of the dead-man cannot be paused");
  if (!row(e.state).setpoint_may_leave)
    return refused_in(e.state, "only a campaign in motion can be paused");
  e.held_by.clear();
  e.after_ramp_down = After::pause;
  e.enter(State::ramp_down, fmt::format("paused by {}", who));
  e.command(e.setpoint.frequency_hz, 0.0);
  return {};
}

Result<void> Engine::resume(const std::string& who) {
  Impl& e = *impl_;
  if (e.pausing()) return refused_in(e.state, "ask again when it is in PAUSE");
  if (e.state != State::pause) return refused_in(e.state, "nothing is paused");
  if (!e.controlled) return refused_in(e.state, "nobody is in control; take control first");
  if (e.ending) {
    return refused_in(e.state, fmt::format("the last estimates of run \"{}\" are awaited; ask "
                                           "again in some seconds",
                                           e.run().name));
  }
  if (auto ok = e.admit_levels(); !ok) return ok;
  if (!e.run_open && e.run_index + 1 == e.campaign->runs.size()) {
    e.end_at_rest("success", fmt::format("campaign \"{}\" is complete", e.campaign->name));
    return {};
  }
  e.resume(fmt::format("resumed by {}", who));
  return {};
}

}  // namespace shaker::daemon
