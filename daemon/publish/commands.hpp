// The commands of clients: JSON-RPC methods that act on the rig, and the control lease.
//
// Called on the clients' thread. docs/protocol.md describes the methods.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "daemon/publish/lease.hpp"
#include "daemon/publish/stream_server.hpp"
#include "protocol/documents.hpp"

namespace shaker::daemon {

// Parameters of the method `diagnose`.
struct DiagnosisRequest {
  std::string campaign;              // name of the campaign or of its file; empty: the newest
  std::optional<std::string> model;  // as JSON; empty: the campaign's own
  double false_alarm_rate = 0.01;    // over the whole catalogue
  bool thorough = false;             // continue as long as hypotheses remain
  std::string out;                   // folder in the daemon's directory; empty: default
};
struct DiagnosisPlace {
  std::string database, folder;  // the file's name; an absolute path
};

// The rig as operators see it: the engine, or a test double.
class RigControl {
 public:
  virtual ~RigControl() = default;
  // Whether a campaign may start now. Called before its file is read.
  virtual Result<void> may_start() = 0;
  // `text` is a campaign as JSON; its relative paths start at `directory`; `origin` is for
  // messages.
  virtual Result<void> start(const std::string& who, const std::string& text,
                             const std::string& origin, const std::string& directory) = 0;
  // Path of the database of the campaign that was started last; empty before the first.
  virtual std::string database() const = 0;
  // What the operator should know of that campaign; empty if there is nothing.
  virtual std::string remark() const = 0;
  // Begins the proof of the exciter's dead-man: motion at `amplitude` (m/s^2), then no
  // heartbeat.
  virtual Result<void> prove_deadman(const std::string& who, double frequency_hz,
                                     double amplitude) = 0;
  virtual Result<void> stop(const std::string& who) = 0;
  virtual Result<void> pause(const std::string& who) = 0;
  virtual Result<void> resume(const std::string& who) = 0;
  virtual Result<void> emergency_stop(const std::string& who) = 0;
  virtual Result<void> acknowledge(const std::string& who) = 0;
  virtual void lease_lost() = 0;
  virtual void set_controlled(bool controlled) = 0;
  virtual protocol::StateDocument state() const = 0;
  virtual Result<DiagnosisPlace> diagnose(const DiagnosisRequest& request) = 0;
  virtual Result<void> cancel_diagnosis(const std::string& who) = 0;
};

class Commands final : public RequestHandler {
 public:
  Commands(RigControl& rig, Clock& clock, Nanoseconds lease);

  Answer handle(const protocol::RpcRequest& request, const Peer& peer) override;
  void gone(const Peer& peer) override;
  // Handles a lease that has expired. Call every few milliseconds.
  void tick();
  std::optional<std::string> in_control() const;  // who, for people

 private:
  struct Method;
  Answer acquire(const Peer& peer);
  Answer release(const Peer& peer);
  Answer renew(const Peer& peer);
  Answer start(const nlohmann::json& params, const Peer& peer);
  Answer status(const Peer& peer) const;
  Answer resume(const Peer& peer);
  Answer prove_deadman(const nlohmann::json& params, const Peer& peer);
  Answer diagnose(const nlohmann::json& params);
  Answer done(const Result<void>& outcome) const;
  Answer started(const Result<void>& outcome) const;

  RigControl& rig_;
  Clock& clock_;
  Lease lease_;
  std::string holder_;  // of the lease, for messages
  Nanoseconds held_since_{};
};

}  // namespace shaker::daemon
