// The clients of the stream: each is given the version, a snapshot, and every document from then
// on; their requests go to a RequestHandler and its answers back to the one who asked.
//
// Whoever wants to stop the rig finds a place. Clients that may only listen have places of their
// own. Of the local clients, all but the first 14 stand on a kept place: when a newer one comes and
// nothing is free, the oldest on a kept place that has commanded nothing of late makes way for it.
// A client on a kept place that has commanded is therefore the one in control, or one that has just
// stopped the rig or asked for a diagnosis at rest: as long as the rig moves, a place can be had.
//
// On the thread of its sd_event loop. Never waits for a client (see Client).
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

namespace shaker::daemon {

// A document on its way out: recorded, serialised, not yet with its newline.
struct PublishedLine {
  std::uint64_t seq = 0;
  std::string_view type;
  std::string text;
};

using Answer = std::variant<nlohmann::json, protocol::RpcError>;

class RequestHandler {
 public:
  virtual ~RequestHandler() = default;
  virtual Answer handle(const protocol::RpcRequest& request, const Peer& peer) = 0;
  // It can send no more requests, or is gone altogether. Once for each client.
  virtual void gone(const Peer& peer) = 0;
};

struct ServerOptions {
  int max_local = 14;                                       // that stay as long as they like
  int kept_places = 2;                                      // beyond them, for commands
  int max_read_only = 8;                                    // TCP
  Nanoseconds command_protects = std::chrono::seconds(10);  // its sender's kept place
  std::size_t max_queued = 2 * 1024 * 1024;                 // bytes for one client
  Nanoseconds condemned_grace = std::chrono::seconds(5);    // to read the last line
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
  // Given again to every client that comes, after the snapshot: what was found at the start.
  void keep_for_late_joiners(const PublishedLine& line);
  int client_count() const { return static_cast<int>(clients_.size()); }
  // Closes clients that were told and did not read. Call a few times a second.
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
  int controller_ = 0;  // the last client that was given control; 0: none
  std::uint64_t last_seq_ = 0;
  Line last_state_, last_estimate_;
  std::vector<Line> kept_;
};

}  // namespace shaker::daemon
