// Server of the stream. Each client receives the version, a snapshot with the alarms that nobody
// has acknowledged, and every later document.
// Its requests go to a RequestHandler, and the answers go back to it.
//
// A client that wants to stop the rig always finds a place. Read-only clients have places of
// their own. The first 14 local clients may stay. The others are on kept places: if a new
// client arrives and no place is free, the oldest client on a kept place without a recent
// command is disconnected. So only the client in control, and those with a recent successful
// command, hold a kept place.
//
// Runs on the thread of its sd_event loop. Never waits for a client (see Client).
#pragma once

#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>
#include <systemd/sd-event.h>

#include "base/clock.hpp"
#include "base/unique_fd.hpp"
#include "daemon/publish/client.hpp"
#include "protocol/documents.hpp"
#include "protocol/rpc.hpp"
#include "protocol/standing_alarms.hpp"

namespace shaker::daemon {

// A recorded and serialised document, without its newline.
struct PublishedLine {
  std::uint64_t seq = 0;
  std::string_view type;
  std::string text;
};

using Answer = std::variant<nlohmann::json, protocol::RpcError>;

// A bit for each document that only subscribers get ("wave", "scope", "rig"); 0 for all others.
unsigned extra_bit(std::string_view type);

class RequestHandler {
 public:
  virtual ~RequestHandler() = default;
  virtual Answer handle(const protocol::RpcRequest& request, const Peer& peer) = 0;
  // The client sends no more requests, or has left. Called once for each client.
  virtual void gone(const Peer& peer) = 0;
};

struct ServerOptions {
  int max_local = 14;                                       // they may stay
  int kept_places = 2;                                      // additional places, for commands
  int max_read_only = 8;                                    // TCP
  Nanoseconds command_protects = std::chrono::seconds(10);  // keeps its sender's place
  std::size_t max_queued = 2 * 1024 * 1024;                 // bytes waiting for one client
  Nanoseconds condemned_grace = std::chrono::seconds(5);    // time to read the last line
};

class StreamServer {
 public:
  // `loop`, `clock` and `handler` outlive the server.
  StreamServer(sd_event* loop, Clock& clock, RequestHandler& handler,
               protocol::VersionDocument version, ServerOptions options = {});
  ~StreamServer();
  StreamServer(const StreamServer&) = delete;
  StreamServer& operator=(const StreamServer&) = delete;

  void add_listener(UniqueFd listener, bool read_only);
  void publish(const PublishedLine& line);
  // Sends a document to the clients that subscribed to its type, except those that lag. The
  // newest wave and rig are repeated to a later subscriber.
  void publish_extra(protocol::Document document);
  bool wants(std::string_view type) const;  // whether any client subscribed to it
  int client_count() const { return static_cast<int>(clients_.size()); }
  // Closes condemned clients that did not read, and reads from those that cannot be sent to.
  // Call a few times a second.
  void tick();

 private:
  struct Listener;
  struct Connection;
  void accept(Listener& listener);
  std::string no_room(bool read_only);
  bool make_way(Connection& connection);
  bool has_commanded(const Connection& connection) const;
  void on_event(Connection& connection, std::uint32_t events);
  void on_readable(Connection& connection);
  void handle(Connection& connection, const std::string& line);
  void answer(Connection& connection, const std::string& line);
  void subscribe(Connection& connection, const nlohmann::json& given);
  Line unnumbered(const protocol::Document& document) const;
  void push(Connection& connection);
  void send_snapshot(Connection& connection);
  void close_later(Connection& connection);
  void reap();

  sd_event* loop_;
  Clock& clock_;
  RequestHandler& handler_;
  protocol::VersionDocument version_;
  ServerOptions options_;
  std::vector<std::unique_ptr<Listener>> listeners_;
  std::map<int, std::unique_ptr<Connection>> clients_;
  int next_client_ = 1;
  int controller_ = 0;  // acquired control last and has not released it; 0: none
  std::uint64_t last_seq_ = 0;
  Line last_state_, last_estimate_;
  protocol::StandingAlarms alarms_;
  std::map<unsigned, protocol::Document> last_extra_;  // by bit
};

}  // namespace shaker::daemon
