// What the daemon says, as documents for the broker.
//
// `state`, `estimate`, `health` and `alarm` go on as the daemon wrote them. A health also gets the
// alarms that nobody has acknowledged. An alarm that the daemon repeats to a new client is
// published once. Pure. One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "mqtt/outbox.hpp"
#include "protocol/standing_alarms.hpp"

namespace shaker::mqtt {

class Relay {
 public:
  // `bridge` says "daemon_lost" until the daemon has answered.
  explicit Relay(Outbox& outbox) : outbox_(outbox) { lost(); }

  // The daemon answers: what it says next begins with what it knows.
  void connected();
  // A line of the daemon; `now` is on CLOCK_MONOTONIC. Returns the name of the rig if the line
  // says it.
  std::optional<std::string> take(const std::string& line, Nanoseconds now);
  void lost() { outbox_.say("daemon_lost"); }

 private:
  using Order =
      std::pair<std::int64_t, std::uint64_t>;  // t_mono_ns, seq: grows from one to the next
  void take_alarm(const nlohmann::json& alarm, const std::string& line, Nanoseconds made);
  std::string standing() const;

  Outbox& outbox_;
  protocol::StandingAlarms alarms_;
  Order newest_{}, known_{};  // alarms up to `known_` came before this connection
};

}  // namespace shaker::mqtt
