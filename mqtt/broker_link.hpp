// The connection to the broker, by libmosquitto: hands over what waits in the outbox, QoS 1 and
// retained.
//
// The will of each connection is PREFIX/RIG/bridge = "offline": the broker publishes it when the
// connection ends without a goodbye, or says nothing for one and a half times kKeepAliveS. The
// client's id is made of PREFIX/RIG, so that a bridge that comes again after a broken network
// replaces its old connection, whose will would otherwise come after the new "online".
//
// Everything is done in the caller's thread and does not block, but for the name look-up and the
// TCP connection, which libmosquitto waits for: each attempt has a thread of its own. A
// connection that ends is tried again after a pause that grows to kMaxPause. For one thread.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <poll.h>

#include "base/clock.hpp"
#include "mqtt/outbox.hpp"

namespace shaker::mqtt {

struct BrokerOptions {
  std::string host = "localhost";
  int port = 1883;
  std::string user, password;  // empty: none
  std::string ca_file;         // empty: no TLS
};

class BrokerLink {
 public:
  static constexpr int kKeepAliveS = 10;
  static constexpr Nanoseconds kMinPause = std::chrono::milliseconds(500);
  static constexpr Nanoseconds kMaxPause = std::chrono::seconds(8);

  BrokerLink(BrokerOptions options, Outbox& outbox, Clock& clock);
  ~BrokerLink();

  // Connects from then on, as the bridge of `base` ("shaker/RIG").
  void speak_for(std::string base);
  bool speaks() const { return !base_.empty(); }
  // What to poll for before the next run(). There are also things to do without: at least once a
  // second.
  pollfd waits_for() const;
  void run();
  // Says "offline" and waits up to `within` until the broker has confirmed it; if it does not, the
  // connection ends without a goodbye, and the broker publishes the will. A thread that tries to
  // connect is left behind: it cannot be called off.
  void leave(Nanoseconds within);

 private:
  struct Session;
  void begin_attempt();
  void hand_over();
  void lose(std::string why, const char* remedy);
  void lose(int status, int code);
  void complain(const std::string& sentence);

  BrokerOptions options_;
  Outbox& outbox_;
  Clock& clock_;
  std::string base_, complained_;
  std::shared_ptr<Session> session_;
  Nanoseconds pause_ = kMinPause, retry_at_{};
};

}  // namespace shaker::mqtt
