// Proves that the exciter stops by itself when its heartbeat is withheld, if its timeout cannot
// be read back. At rest: the exciter, enabled at amplitude zero, must report its trip. In
// motion, at a small amplitude and on an operator's request: the table must come to rest.
#include <algorithm>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"

namespace shaker::daemon {
namespace {

using protocol::Channel;

constexpr double kReportS = 0.3;      // delay of the report of a trip
constexpr double kBeatsS = 0.3;       // enabled with heartbeat for this long first
constexpr double kRestWindowS = 0.4;  // the window of RestWatch

}  // namespace

// A replay moves no table.
bool Engine::Impl::moves_nothing() const {
  return std::holds_alternative<config::ReplayExciter>(rig.exciter.device);
}

// Time after the last heartbeat at which the exciter stops by itself, s; 0: it does not.
double Engine::Impl::deadman_s() const {
  if (status && status->heartbeat_timeout_s) return *status->heartbeat_timeout_s;
  return deadman_proved.value_or(rig.exciter.deadman_max_s);
}

bool Engine::Impl::wants_deadman_proof() const {
  return !deadman_proved && status && !status->heartbeat_timeout_s && !moves_nothing();
}

void Engine::Impl::begin_proof_at_rest() {
  proving = DeadmanProof{.in_motion = false, .withheld = false, .began = clock.now()};
  exciter.keep_alive(true);
  exciter.set(
      {.frequency_hz = run().frequency_hz, .amplitude = 0.0, .enable = true, .ramp_s = 0.0});
}

void Engine::Impl::begin_proof_in_motion() {
  proving = DeadmanProof{.in_motion = true, .withheld = true, .began = clock.now()};
  exciter.keep_alive(false);
}

void Engine::Impl::tick_proof() {
  const DeadmanProof& proof = *proving;
  const double most = rig.exciter.deadman_max_s;
  const bool fresh = status && status->t > proof.began && !exciter_error;
  if (!proof.withheld) {
    if (fresh && status->ready && since(proof.began) > kBeatsS) {
      proving->withheld = true;
      proving->began = clock.now();
      exciter.keep_alive(false);
    } else if (since(proof.began) > kReadyGraceS + kBeatsS) {
      fail_proof("it does not report ready when it is enabled at amplitude zero");
    }
    return;
  }
  if (proof.in_motion) {
    const bool stands = table_is_seen() ? table_motion(proof.began) == Motion::rests &&
                                              !rest(Channel::excitation).moves()
                                        : fresh && !status->running;
    const double window = table_is_seen() ? kRestWindowS : 0.0;
    if (stands) return end_proof(std::max(0.0, since(proof.began) - window));
    if (since(proof.began) > most + window + kReportS)
      fail_proof(fmt::format("the table still moves {:g} s after the last heartbeat", most));
    return;
  }
  if (fresh && (status->fault != 0 || !status->ready))
    return end_proof(seconds(status->t - proof.began));
  if (since(proof.began) > most + kReportS) {
    fail_proof(
        fmt::format("enabled at amplitude zero it reports no trip within {:g} s of the last "
                    "heartbeat",
                    most));
  }
}

void Engine::Impl::end_proof(double took) {
  const bool in_motion = proving->in_motion;
  deadman_proved = took;
  deadman_proved_in_motion = in_motion;
  proving.reset();
  const std::string text =
      fmt::format("the exciter's dead-man acts {}: {:.2f} s after the last heartbeat",
                  in_motion ? "in motion" : "at rest", took);
  if (in_motion) end_run("success", text);
  halt();
  if (status && status->fault != 0) exciter.clear_fault();
  alarm("info", "deadman_proved", text);
  if (in_motion) {
    ramp_down("success", text, After::idle);
  } else {
    entered = clock.now();  // CHECK begins again, with the exciter disabled
    wait_for_rest();
  }
}

void Engine::Impl::fail_proof(const std::string& why) {
  const bool in_motion = proving->in_motion;
  proving.reset();
  halt();
  const std::string text = fmt::format(
      "the exciter's dead-man is not proved: {}; set a timeout of at most {:g} s in the drive{}",
      why, rig.exciter.deadman_max_s,
      in_motion ? "" : ", or prove it at a small amplitude with shakerctl prove-deadman");
  alarm("error", "deadman_unproven", text);
  if (in_motion) return trip(text);
  end_at_rest("fail", text);
}

}  // namespace shaker::daemon
