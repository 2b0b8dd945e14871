#include "daemon/publish/stream_server.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <system_error>

#include "daemon/publish/event_loop.hpp"
#include "daemon/publish/user_name.hpp"

namespace shaker::daemon {
namespace {

Line as_line(std::string text) {
  text += '\n';
  return std::make_shared<const std::string>(std::move(text));
}

bool is_tcp(int fd) {
  int domain = AF_UNIX;
  socklen_t size = sizeof domain;
  return ::getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) == 0 && domain != AF_UNIX;
}

std::string describe_peer(int fd) {
  if (is_tcp(fd)) return "a TCP client";
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return "someone";
  return fmt::format("{} (pid {})", user_name(credentials.uid), credentials.pid);
}

Line refusal(std::string why) {
  return as_line(
      protocol::error_line({protocol::RpcCode::too_many_clients, std::move(why), nullptr}));
}

// True for commands. Queries do not protect their sender's place.
bool commands(const protocol::RpcRequest& request) {
  return request.method != "ping" && request.method != "status" && request.method != "subscribe";
}

// The estimate of the campaign before is not that of this one.
bool begins_campaign(const std::string& run_start) {
  const auto document = nlohmann::json::parse(run_start, nullptr, false);
  return document.is_object() && document.value("run_index", nlohmann::json()) == 0;
}

EventSource add_io(sd_event* loop, int fd, std::uint32_t events, sd_event_io_handler_t callback,
                   void* self) {
  sd_event_source* source = nullptr;
  const int code = ::sd_event_add_io(loop, &source, fd, events, callback, self);
  if (code < 0) throw std::system_error(-code, std::generic_category(), "sd_event_add_io");
  return EventSource(source);
}

}  // namespace

struct StreamServer::Listener {
  StreamServer* server = nullptr;
  UniqueFd fd;
  bool read_only = false;
  EventSource source;
};

struct StreamServer::Connection {
  Connection(StreamServer& owner, UniqueFd fd, Peer peer, std::size_t max_queued)
      : server(&owner), client(std::move(fd), std::move(peer), max_queued) {}
  StreamServer* server;
  Client client;
  EventSource source;
  std::optional<Nanoseconds> commanded_at;  // time of its last successful command
  bool silent = false;                      // it sends no more
  unsigned extras = 0;                      // bits of the documents that it subscribed to
  bool deaf = false;  // nothing can be sent to it; its input is read to the end
  bool dead = false;  // reap() removes it, never within its own callback
};

StreamServer::StreamServer(sd_event* loop, Clock& clock, RequestHandler& handler,
                           protocol::VersionDocument version, ServerOptions options)
    : loop_(loop),
      clock_(clock),
      handler_(handler),
      version_(std::move(version)),
      options_(options) {}

StreamServer::~StreamServer() = default;

unsigned extra_bit(std::string_view type) {
  return type == "wave" ? 1U : type == "scope" ? 2U : type == "rig" ? 4U : 0U;
}

void StreamServer::add_listener(UniqueFd listener, bool read_only) {
  auto owned = std::make_unique<Listener>();
  owned->server = this;
  owned->fd = std::move(listener);
  owned->read_only = read_only;
  owned->source = add_io(
      loop_, owned->fd.get(), EPOLLIN,
      [](sd_event_source*, int, std::uint32_t, void* self) {
        auto& ready = *static_cast<Listener*>(self);
        ready.server->accept(ready);
        return 0;
      },
      owned.get());
  listeners_.push_back(std::move(owned));
}

// The reason to refuse another client; empty if there is room.
std::string StreamServer::no_room(bool read_only) {
  std::vector<Connection*> there;  // in order of their arrival
  for (const auto& [number, connection] : clients_) {
    if (!connection->dead && connection->client.peer().read_only == read_only)
      there.push_back(connection.get());
  }
  const auto stay =
      static_cast<std::size_t>(read_only ? options_.max_read_only : options_.max_local);
  const auto most = stay + static_cast<std::size_t>(read_only ? 0 : options_.kept_places);
  if (there.size() < most) return {};
  if (read_only) {
    return fmt::format(
        "{} clients that may only listen are connected already, and that is the limit; close one "
        "of them, or use the Unix socket of the group shaker.",
        most);
  }
  for (std::size_t i = stay; i < there.size(); ++i) {
    if (make_way(*there[i])) return {};
  }
  return fmt::format(
      "{} clients are connected already, and those on the places kept for commands have just "
      "commanded; close one of them, or try again in {:.0f} s.",
      most, seconds(options_.command_protects));
}

// Handles its pending input first: it may be a stop.
bool StreamServer::make_way(Connection& connection) {
  on_readable(connection);
  if (connection.dead) return true;
  if (has_commanded(connection)) return false;
  spdlog::info("Client {} makes way for a newer one.", connection.client.peer().client);
  connection.client.send(
      refusal(fmt::format("{} clients are connected and a newer one has come; this one has "
                          "commanded nothing and made way. Close one of the others and connect "
                          "again.",
                          options_.max_local + options_.kept_places)),
      clock_.now());
  connection.client.flush();
  close_later(connection);
  return true;
}

bool StreamServer::has_commanded(const Connection& connection) const {
  if (connection.client.peer().client == controller_) return true;
  return connection.commanded_at &&
         clock_.now() - *connection.commanded_at < options_.command_protects;
}

void StreamServer::accept(Listener& listener) {
  UniqueFd fd(::accept4(listener.fd.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!fd.valid()) return;
  const std::string full = no_room(listener.read_only);
  reap();
  if (!full.empty()) {
    const Line line = refusal(full);
    // Best effort: the buffer of a new socket is empty.
    if (::send(fd.get(), line->data(), line->size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) return;
    return;
  }
  const int number = next_client_++;
  Peer peer{number, describe_peer(fd.get()), listener.read_only};
  auto owned =
      std::make_unique<Connection>(*this, std::move(fd), std::move(peer), options_.max_queued);
  Connection& connection = *owned;
  connection.source = add_io(
      loop_, connection.client.fd(), EPOLLIN,
      [](sd_event_source*, int, std::uint32_t events, void* self) {
        auto& ready = *static_cast<Connection*>(self);
        StreamServer& server = *ready.server;
        server.on_event(ready, events);
        server.reap();
        return 0;
      },
      &connection);
  clients_.emplace(number, std::move(owned));
  spdlog::info("Client {} connected: {}.", number, connection.client.peer().who);
  send_snapshot(connection);
}

// Sends all that a new client needs. The version's seq is that of the newest document, so that
// the next one follows without a gap. State and estimate are repeated as they were published.
void StreamServer::send_snapshot(Connection& connection) {
  const Nanoseconds now = clock_.now();
  connection.client.send(unnumbered(version_), now);
  if (last_state_) connection.client.send(last_state_, now);
  if (last_estimate_) connection.client.send(last_estimate_, now);
  for (const protocol::StandingAlarm& alarm : alarms_.all())
    connection.client.send(as_line(alarm.line), now);
  push(connection);
}

// Carries the number of the newest numbered document.
Line StreamServer::unnumbered(const protocol::Document& document) const {
  return as_line(protocol::to_json_line(
      document, {last_seq_, format_utc(clock_.utc()), clock_.now().count()}));
}

// A client that has left may have left requests, even a stop. They are handled first, a few in
// each turn: the loop reports such a connection as ready repeatedly.
void StreamServer::on_event(Connection& connection, std::uint32_t events) {
  const bool hung_up = (events & (EPOLLHUP | EPOLLERR)) != 0;
  if (((events & EPOLLIN) != 0 || hung_up) && !connection.silent) on_readable(connection);
  if ((events & EPOLLOUT) != 0) push(connection);
  if (hung_up && connection.silent) close_later(connection);
}

void StreamServer::on_readable(Connection& connection) {
  const auto input = connection.client.receive();
  for (int i = 0; i < input.too_long; ++i) {
    answer(connection, protocol::error_line({protocol::RpcCode::line_too_long,
                                             fmt::format("A line of more than {} bytes was thrown "
                                                         "away; send less in one request.",
                                                         protocol::kMaxRequestLine),
                                             nullptr}));
  }
  for (const std::string& line : input.lines)
    handle(connection, line);
  if (input.ended && !connection.silent) {
    connection.silent = true;  // it may continue to listen, as `nc -N` does
    handler_.gone(connection.client.peer());
  }
  if (connection.deaf && (input.ended || input.nothing)) return close_later(connection);
  push(connection);
}

void StreamServer::handle(Connection& connection, const std::string& line) {
  auto parsed = protocol::parse_request(line);
  if (const auto* error = std::get_if<protocol::RpcError>(&parsed))
    return answer(connection, protocol::error_line(*error));
  const auto& request = std::get<protocol::RpcRequest>(parsed);
  Answer given = handler_.handle(request, connection.client.peer());
  auto* error = std::get_if<protocol::RpcError>(&given);
  if (!error && commands(request)) connection.commanded_at = clock_.now();
  const int asking = connection.client.peer().client;
  if (!error && request.method == "subscribe")
    subscribe(connection, std::get<nlohmann::json>(given));
  if (!error && request.method == "control.acquire") controller_ = asking;
  if (!error && request.method == "control.release" && controller_ == asking) controller_ = 0;
  if (!request.id) return;  // a notification is never answered
  if (error) {
    error->id = *request.id;
    answer(connection, protocol::error_line(*error));
  } else {
    answer(connection, protocol::result_line(*request.id, std::get<nlohmann::json>(given)));
  }
}

void StreamServer::subscribe(Connection& connection, const nlohmann::json& given) {
  connection.extras = 0;
  for (const auto& type : given["documents"])
    connection.extras |= extra_bit(type.get<std::string>());
  for (const auto& [bit, document] : last_extra_) {
    if ((connection.extras & bit) != 0) connection.client.send(unnumbered(document), clock_.now());
  }
}

bool StreamServer::wants(std::string_view type) const {
  const unsigned bit = extra_bit(type);
  return std::ranges::any_of(clients_, [bit](const auto& entry) {
    return !entry.second->dead && (entry.second->extras & bit) != 0;
  });
}

void StreamServer::publish_extra(protocol::Document document) {
  const std::string_view type = protocol::type_name(document);
  const unsigned bit = extra_bit(type);
  if (wants(type)) {
    const Line line = unnumbered(document);
    const Nanoseconds now = clock_.now();
    for (auto& [number, connection] : clients_) {
      if ((connection->extras & bit) == 0 || connection->deaf || connection->client.lags())
        continue;
      connection->client.send(line, now);
      push(*connection);
    }
    reap();
  }
  if (type != "scope") last_extra_.insert_or_assign(bit, std::move(document));
}

void StreamServer::answer(Connection& connection, const std::string& line) {
  if (!connection.deaf) connection.client.send(as_line(line), clock_.now(), Client::Kind::answer);
}

void StreamServer::push(Connection& connection) {
  if (connection.dead) return;
  const Client& client = connection.client;
  if (!connection.deaf && !connection.client.flush()) {
    if (client.condemned_since() || connection.silent) return close_later(connection);
    connection.deaf = true;
  }
  const bool reading = !connection.silent && (connection.deaf || client.reads_answers());
  const bool writing = !connection.deaf && client.wants_to_write();
  ::sd_event_source_set_io_events(connection.source.get(),
                                  (reading ? EPOLLIN : 0U) | (writing ? EPOLLOUT : 0U));
}

void StreamServer::publish(const PublishedLine& document) {
  const Line line = as_line(document.text);
  last_seq_ = document.seq;
  if (document.type == "state") last_state_ = line;
  // A campaign begins: the last wave is of another one.
  if (document.type == "state" && document.text.find(R"("state":"CHECK")") != std::string::npos)
    last_extra_.erase(extra_bit("wave"));
  if (document.type == "estimate") last_estimate_ = line;
  if (document.type == "alarm")
    alarms_.take(nlohmann::json::parse(document.text, nullptr, false), document.text);
  if (document.type == "run_start" && begins_campaign(document.text)) last_estimate_.reset();
  const Nanoseconds now = clock_.now();
  for (auto& [number, connection] : clients_) {
    if (connection->deaf) continue;
    connection->client.send(line, now);
    push(*connection);
  }
  reap();
}

void StreamServer::tick() {
  const Nanoseconds now = clock_.now();
  for (auto& [number, connection] : clients_) {
    const auto since = connection->client.condemned_since();
    if (since && now - *since > options_.condemned_grace) close_later(*connection);
    // The other side may have closed one direction only, which the loop does not report.
    if (connection->deaf && !connection->dead) on_readable(*connection);
  }
  reap();
}

void StreamServer::close_later(Connection& connection) {
  if (connection.dead) return;
  connection.dead = true;
  ::sd_event_source_set_enabled(connection.source.get(), SD_EVENT_OFF);
}

void StreamServer::reap() {
  for (auto it = clients_.begin(); it != clients_.end();) {
    if (!it->second->dead) {
      ++it;
      continue;
    }
    const auto owned = std::move(it->second);
    it = clients_.erase(it);
    const Client& client = owned->client;
    if (client.condemned_since()) {
      spdlog::warn("Client {} ({}) read too slowly: it missed {} lines and was dropped.",
                   client.peer().client, client.peer().who, client.missed());
    } else {
      spdlog::info("Client {} is gone.", client.peer().client);
    }
    if (!owned->silent) handler_.gone(client.peer());
  }
}

}  // namespace shaker::daemon
