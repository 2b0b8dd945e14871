#include "daemon/publish/stream_server.hpp"

#include <array>
#include <cerrno>
#include <pwd.h>

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <system_error>

#include "daemon/publish/event_loop.hpp"

namespace shaker::daemon {
namespace {

constexpr std::size_t kMaxKept = 16;

Line as_line(std::string text) {
  text += '\n';
  return std::make_shared<const std::string>(std::move(text));
}

std::string describe_peer(int fd, bool read_only) {
  if (read_only) return "a TCP client";
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return "someone";
  std::array<char, 4096> buffer;
  passwd entry{}, *found = nullptr;
  ::getpwuid_r(credentials.uid, &entry, buffer.data(), buffer.size(), &found);
  const std::string user = found ? found->pw_name : fmt::format("uid {}", credentials.uid);
  return fmt::format("{} (pid {})", user, credentials.pid);
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
  bool silent = false;  // it will send no more
  bool dead = false;    // removed by reap(), never inside a callback of its own
};

StreamServer::StreamServer(sd_event* loop, Clock& clock, RequestHandler& handler,
                           protocol::VersionDocument version, ServerOptions options)
    : loop_(loop),
      clock_(clock),
      handler_(handler),
      version_(std::move(version)),
      options_(options) {}

StreamServer::~StreamServer() = default;

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

void StreamServer::accept(Listener& listener) {
  UniqueFd fd(::accept4(listener.fd.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!fd.valid()) return;
  if (client_count() >= options_.max_clients) {
    const auto line = as_line(protocol::error_line(
        {protocol::RpcCode::too_many_clients,
         fmt::format("{} clients are connected already, and that is the limit; close one of them.",
                     options_.max_clients),
         nullptr}));
    // Best effort: a fresh socket's buffer is empty.
    if (::send(fd.get(), line->data(), line->size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) return;
    return;
  }
  const int number = next_client_++;
  Peer peer{number, describe_peer(fd.get(), listener.read_only), listener.read_only};
  auto owned =
      std::make_unique<Connection>(*this, std::move(fd), std::move(peer), options_.max_queued);
  Connection& connection = *owned;
  connection.source = add_io(
      loop_, connection.client.fd(), EPOLLIN,
      [](sd_event_source*, int, std::uint32_t events, void* self) {
        auto& ready = *static_cast<Connection*>(self);
        StreamServer& server = *ready.server;
        if ((events & EPOLLIN) != 0 && !ready.silent) server.on_readable(ready);
        if ((events & EPOLLOUT) != 0 && !ready.dead) server.push(ready);
        if ((events & (EPOLLHUP | EPOLLERR)) != 0) server.close_later(ready);
        server.reap();
        return 0;
      },
      &connection);
  clients_.emplace(number, std::move(owned));
  spdlog::info("Client {} connected: {}.", number, connection.client.peer().who);
  send_snapshot(connection);
}

// A late joiner needs nothing else. The version's seq is that of the newest document, so that the
// next one follows it without a gap; state and estimate are repeated as they were published.
void StreamServer::send_snapshot(Connection& connection) {
  const protocol::Envelope envelope{last_seq_, format_utc(clock_.utc()), clock_.now().count()};
  const Nanoseconds now = clock_.now();
  connection.client.send(as_line(protocol::to_json_line(version_, envelope)), now);
  if (last_state_) connection.client.send(last_state_, now);
  if (last_estimate_) connection.client.send(last_estimate_, now);
  for (const Line& line : kept_)
    connection.client.send(line, now);
  push(connection);
}

void StreamServer::keep_for_late_joiners(const PublishedLine& line) {
  if (kept_.size() < kMaxKept) kept_.push_back(as_line(line.text));
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
  for (const std::string& line : input.lines) {
    auto parsed = protocol::parse_request(line);
    if (const auto* error = std::get_if<protocol::RpcError>(&parsed)) {
      answer(connection, protocol::error_line(*error));
      continue;
    }
    const auto& request = std::get<protocol::RpcRequest>(parsed);
    Answer given = handler_.handle(request, connection.client.peer());
    if (!request.id) continue;  // a notification is never answered
    if (auto* error = std::get_if<protocol::RpcError>(&given)) {
      error->id = *request.id;
      answer(connection, protocol::error_line(*error));
    } else {
      answer(connection, protocol::result_line(*request.id, std::get<nlohmann::json>(given)));
    }
  }
  if (input.ended && !connection.silent) {
    connection.silent = true;  // it may go on listening, as `nc -N` does
    handler_.gone(connection.client.peer());
  }
  push(connection);
}

void StreamServer::answer(Connection& connection, const std::string& line) {
  connection.client.send(as_line(line), clock_.now());
}

void StreamServer::push(Connection& connection) {
  if (connection.dead) return;
  if (!connection.client.flush()) return close_later(connection);
  const bool reading = !connection.silent && !connection.client.condemned_since();
  const std::uint32_t events =
      (reading ? EPOLLIN : 0U) | (connection.client.wants_to_write() ? EPOLLOUT : 0U);
  ::sd_event_source_set_io_events(connection.source.get(), events);
}

void StreamServer::publish(const PublishedLine& document) {
  const Line line = as_line(document.text);
  last_seq_ = document.seq;
  if (document.type == "state") last_state_ = line;
  if (document.type == "estimate") last_estimate_ = line;
  const Nanoseconds now = clock_.now();
  for (auto& [number, connection] : clients_) {
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
