// The rig's state machine: from an operator's campaign to accepted cycles and estimates, safely.
//
//   IDLE -> CHECK -> RAMP -> SETTLE -> MEASURE -> (next run: RAMP ...) -> RAMP_DOWN -> IDLE
//   any of them -> RAMP_DOWN or FAULT; FAULT is latched until `acknowledge`.
//
// One thread. Time comes from the Clock only, samples and exciter status come in by call, setpoints
// go out through `ExciterCommands`; so that the same engine runs a campaign on the real rig and, in
// simulated time, a day's campaign in seconds. Never blocks, never throws.
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
#include "estimator/online_estimator.hpp"

namespace shaker::daemon {

enum class State { idle, check, ramp, settle, measure, ramp_down, fault };

// Orders to the exciter's thread; returns at once. The answers come back through
// Engine::on_exciter_status and on_exciter_error.
class ExciterCommands {
 public:
  virtual ~ExciterCommands() = default;
  virtual void set(const drivers::Setpoint& setpoint) = 0;
  virtual void stop() = 0;                   // at once, without a ramp; overtakes everything queued
  virtual void keep_alive(bool wanted) = 0;  // heartbeat while motion is commanded
  virtual void clear_fault() = 0;            // of the device itself, where it has an order for it
};

// Orders to the estimator's thread; returns at once. The answer comes back through on_estimate.
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

  // --- what the outside reports
  void on_samples(std::span<const drivers::Sample> samples);
  void on_sensor_health(const drivers::SensorHealth& health, drivers::StampSource stamps);
  void on_sensor_error(const Error& error);
  void on_exciter_status(const drivers::ExciterStatus& status);
  void on_exciter_error(const Error& error);
  // The exciter's thread no longer serves the heartbeat and has stopped the exciter.
  void on_heartbeat_withheld(const std::string& why);
  // Between two heartbeats so much time went by. Longer than the exciter's dead-man takes, and it
  // has stopped the table: that is the fault, not what the sensors then show.
  void on_late_heartbeat(double gap_s);
  void on_estimate(const EstimateOutcome& outcome);
  // Every 1 to 10 ms: timeouts, ramps, limits, the 1 Hz health document.
  void tick();

  // Something around the engine fails, and no motion may go on: ramps down into FAULT. Nothing when
  // nothing moves.
  void end_motion(const std::string& code, const std::string& why);

  // --- what an operator asks. An Error is the sentence to show.
  Result<void> may_start() const;                                // now
  Result<void> admit(const config::CampaignSpec& wanted) const;  // this one, now
  Result<void> start(const config::CampaignSpec& campaign);
  // The first run of `gentle` is begun; once its amplitude is reached, the heartbeat is withheld
  // and the table must come to rest within deadman_max_s.
  Result<void> prove_deadman(const config::CampaignSpec& gentle);
  // The exciter's dead-man was seen to act, so many seconds after the last heartbeat: by this
  // engine, or earlier with the same rig file. Where its timeout cannot be read, CHECK asks for
  // that.
  struct DeadmanSeen {
    double seconds = 0.0;
    bool in_motion = false;
  };
  std::optional<DeadmanSeen> deadman_seen() const;
  void trust_deadman(const DeadmanSeen& seen);
  Result<void> stop(const std::string& who);            // ramp down; anyone's
  Result<void> emergency_stop(const std::string& who);  // zero at once, latches FAULT; anyone's
  // Leaves FAULT when its cause is gone. Where that is a fault that the exciter itself latches and
  // that its register map can clear, it is told to, and FAULT is left when it has.
  Result<void> acknowledge(const std::string& who);
  void lease_lost();  // the controlling client is gone: ramp down
  void set_controlled(bool controlled);
  void set_client_count(int clients);
  void publish(const protocol::Document& document);  // of a worker; in order with the engine's own

  State state() const;
  double ramp_s() const;  // how long the way down takes
  protocol::StateDocument state_document() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::daemon
