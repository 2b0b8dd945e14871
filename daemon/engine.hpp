// The state machine of the rig: runs an operator's campaign safely, and produces accepted
// cycles and estimates.
//
//   IDLE -> CHECK -> RAMP -> SETTLE -> MEASURE -> (next run: RAMP ...) -> RAMP_DOWN -> IDLE
//   any of them -> RAMP_DOWN or FAULT; FAULT is latched until `acknowledge`.
//   a pause: RAMP_DOWN -> PAUSE, and by `resume` -> CHECK
//
// All calls come from one thread. Time comes from the Clock only; samples and exciter status
// arrive by calls; setpoints leave through `ExciterCommands`. Therefore the same engine runs a
// campaign on the real rig and, in simulated time, a day's campaign in seconds. Never blocks,
// never throws.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/campaign.hpp"
#include "config/rig.hpp"
#include "daemon/outlet.hpp"
#include "drivers/exciter.hpp"
#include "drivers/sensor.hpp"
#include "estimator/estimate.hpp"
#include "estimator/online/online_estimator.hpp"

namespace shaker::daemon {

enum class State { idle, check, ramp, settle, measure, ramp_down, fault, pause };

// Orders to the exciter's thread. Each call returns at once. The answers arrive through
// Engine::on_exciter_status and on_exciter_error.
class ExciterCommands {
 public:
  virtual ~ExciterCommands() = default;
  virtual void set(const drivers::Setpoint& setpoint) = 0;
  virtual void stop() = 0;                   // immediate, without a ramp; overtakes queued orders
  virtual void keep_alive(bool wanted) = 0;  // whether the heartbeat is sent
  virtual void clear_fault() = 0;            // the device's own fault, as far as it can be cleared
};

// Orders to the estimator's thread. Each call returns at once. The answer arrives through
// Engine::on_estimate.
class EstimatorCommands {
 public:
  virtual ~EstimatorCommands() = default;
  virtual void begin(const config::ModelSpec& model, const estimator::OnlineOptions& options) = 0;
  virtual void add(const estimator::MeasuredCycle& cycle, Nanoseconds last_sample) = 0;
};

struct EstimateOutcome {
  int run = 0;
  long cycle = 0;
  Nanoseconds last_sample{};
  long cycles_skipped = 0;
  Result<estimator::Estimate> estimate = Error{};
};

class Engine {
 public:
  Engine(const config::RigConfig& rig, Clock& clock, ExciterCommands& exciter,
         EstimatorCommands& estimator, Outlet& outlet);
  ~Engine();

  // --- reports from outside
  void on_samples(std::span<const drivers::Sample> samples);
  void on_sensor_health(const drivers::SensorHealth& health, drivers::StampSource stamps);
  void on_sensor_error(const Error& error);
  void on_exciter_status(const drivers::ExciterStatus& status);
  void on_exciter_error(const Error& error);
  // The exciter's thread no longer serves the heartbeat and has stopped the exciter.
  void on_heartbeat_withheld(const std::string& why);
  // The pause between two heartbeats, s. If it exceeds the exciter's dead-man timeout, the
  // exciter has stopped the table by itself. This is then the fault, not what the sensors show
  // as a result.
  void on_late_heartbeat(double gap_s);
  void on_estimate(const EstimateOutcome& outcome);
  // Call every 1 to 10 ms: handles timeouts, ramps, limits and the 1 Hz health document.
  void tick();

  // Something outside the engine has failed, and motion must end: ramps down into FAULT. Does
  // nothing if nothing moves.
  void end_motion(const std::string& code, const std::string& why);

  // --- orders of an operator. The text of an Error is for the operator.
  Result<void> may_start() const;                                // whether any campaign may start
  Result<void> admit(const config::CampaignSpec& wanted) const;  // whether this one may start
  Result<void> start(const config::CampaignSpec& campaign);
  // Starts the first run of `gentle`. Once its amplitude is reached, the heartbeat is withheld,
  // and the table must come to rest within deadman_max_s.
  Result<void> prove_deadman(const config::CampaignSpec& gentle);
  // Evidence that the exciter's dead-man works: it acted this long after the last heartbeat,
  // observed by this engine or earlier with the same rig file. CHECK requires it if the timeout
  // cannot be read.
  struct DeadmanSeen {
    double seconds = 0.0;
    bool in_motion = false;
  };
  std::optional<DeadmanSeen> deadman_seen() const;
  void trust_deadman(const DeadmanSeen& seen);
  Result<void> stop(const std::string& who);  // ramps down; any client may call it
  // Ramps to rest and keeps the campaign open, in PAUSE; any client may call it. Only `resume`,
  // with a client in control, leads back to motion. A client that is lost does not end a pause.
  Result<void> pause(const std::string& who);
  Result<void> resume(const std::string& who);
  Result<void> emergency_stop(const std::string& who);  // zero at once, FAULT; any client may
  // Ends the alarms, and leaves FAULT if its cause is gone. An exciter that reports a fault is told
  // to clear it, and FAULT is left once it has done so.
  Result<void> acknowledge(const std::string& who);
  void lease_lost();  // the controlling client is gone: ramps down
  void set_controlled(bool controlled);
  void set_client_count(int clients);
  void publish(const protocol::Document& document);  // for a worker; in order with the engine's own

  State state() const;    // any thread; no earlier than the last published document
  double ramp_s() const;  // duration of the ramp
  protocol::StateDocument state_document() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::daemon
