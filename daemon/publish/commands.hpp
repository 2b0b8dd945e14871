// What a client may ask for: JSON-RPC methods to the rig, and who is in control.
//
// On the clients' thread. docs/protocol.md lists the methods for people.
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

// A diagnosis that is wanted, as `diagnose` says it.
struct DiagnosisRequest {
  std::string campaign;              // its name or its file's; empty: the newest
  std::optional<std::string> model;  // as JSON; nothing: the campaign's own
  double false_alarm_rate = 0.01;    // over the whole catalogue
  bool thorough = false;             // as long as there is more to try
  std::string out;                   // folder in the daemon's directory; empty: after the file
};
struct DiagnosisPlace {
  std::string database, folder;  // the file's name; absolute
};

// The rig as its operators see it: the engine, or a test's own.
class RigControl {
 public:
  virtual ~RigControl() = default;
  // Could a campaign start now? Asked before its file is read.
  virtual Result<void> may_start() = 0;
  // `text` is a campaign as JSON; paths in it start at `directory`, `origin` is for messages.
  virtual Result<void> start(const std::string& who, const std::string& text,
                             const std::string& origin, const std::string& directory) = 0;
  // Begins the operator's proof of the exciter's dead-man: motion at `amplitude` (m/s^2), then
  // silence.
  virtual Result<void> prove_deadman(const std::string& who, double frequency_hz,
                                     double amplitude) = 0;
  virtual Result<void> stop(const std::string& who) = 0;
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
  // Notices a lease that has run out. Call every few milliseconds.
  void tick();

 private:
  struct Method;
  Answer acquire(const Peer& peer);
  Answer release(const Peer& peer);
  Answer renew(const Peer& peer);
  Answer start(const nlohmann::json& params, const Peer& peer);
  Answer status(const Peer& peer) const;
  Answer prove_deadman(const nlohmann::json& params, const Peer& peer);
  Answer diagnose(const nlohmann::json& params);
  Answer done(const Result<void>& outcome) const;

  RigControl& rig_;
  Clock& clock_;
  Lease lease_;
  std::string holder_;  // of the lease, for people
  Nanoseconds held_since_{};
};

}  // namespace shaker::daemon
