#include "gateway/http_server.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace shaker::gateway {
namespace {

constexpr unsigned kMaxConnections = 200;   // all requests together
constexpr unsigned kIdleS = 30;             // without a byte either way; then it is closed
constexpr std::size_t kMemory = 32 * 1024;  // for the header of a request
constexpr int kSendBuffer = 32 * 1024;      // of the kernel, for a stream of events
constexpr std::size_t kBlock = 16 * 1024;
constexpr int kLongestWaitMs = 1000;

void header(MHD_Response* response, const char* name, const std::string& value) {
  MHD_add_response_header(response, name, value.c_str());
}

void common_headers(MHD_Response* response, const Reply& reply, bool report) {
  header(response, "Content-Type", reply.type);
  header(response, "Content-Security-Policy", report ? kReportPolicy : kPolicy);
  header(response, "X-Content-Type-Options", "nosniff");
  header(response, "Referrer-Policy", "no-referrer");
  header(response, "Cross-Origin-Resource-Policy", "same-origin");
  header(response, "Cache-Control", reply.shared.empty() ? "no-store" : "no-cache");
  if (reply.status == 405) header(response, "Allow", "GET, HEAD");
  if (!reply.location.empty()) header(response, "Location", reply.location);
  if (!reply.file_name.empty())
    header(response, "Content-Disposition", "attachment; filename=\"" + reply.file_name + "\"");
}

std::string_view text_of(const char* text) {
  return text == nullptr ? std::string_view() : std::string_view(text);
}

int socket_of(MHD_Connection* connection) {
  const auto* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
  return info == nullptr ? -1 : info->connect_fd;
}

// "7" as the browser repeats it; nothing for rubbish.
std::optional<std::uint64_t> last_event_id(MHD_Connection* connection) {
  const std::string_view text =
      text_of(MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Last-Event-ID"));
  if (text.empty() || text.size() > 18) return std::nullopt;
  std::uint64_t value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + static_cast<std::uint64_t>(c - '0');
  }
  return value;
}

}  // namespace

// A stream of events. Suspended while there is nothing to send.
struct HttpServer::Connection {
  HttpServer* server;
  const ShownRig* rig;  // null: the list of all
  MHD_Connection* http;
  Browser browser;
  bool suspended = false, given_up = false;
};

HttpServer::HttpServer(const HttpOptions& options, const Rigs& rigs)
    : options_(options), rigs_(rigs) {}

Result<std::unique_ptr<HttpServer>> HttpServer::make(const HttpOptions& options, const Rigs& rigs) {
  std::unique_ptr<HttpServer> server(new HttpServer(options, rigs));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(options.port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  void* raw = &address;
  const bool given = options.listening >= 0;
  std::array<MHD_OptionItem, 5> items = {
      {{MHD_OPTION_CONNECTION_LIMIT, kMaxConnections, nullptr},
       {MHD_OPTION_CONNECTION_TIMEOUT, kIdleS, nullptr},
       {MHD_OPTION_CONNECTION_MEMORY_LIMIT, static_cast<std::intptr_t>(kMemory), nullptr},
       given ? MHD_OptionItem{MHD_OPTION_LISTEN_SOCKET, options.listening, nullptr}
             : MHD_OptionItem{MHD_OPTION_SOCK_ADDR, 0, raw},
       {MHD_OPTION_END, 0, nullptr}}};
  server->daemon_ = MHD_start_daemon(MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME, 0, nullptr, nullptr,
                                     &HttpServer::on_request, server.get(), MHD_OPTION_ARRAY,
                                     items.data(), MHD_OPTION_END);
  if (server->daemon_ == nullptr) {
    return Error{ErrorKind::io, fmt::format("--port {}: cannot listen on 127.0.0.1 ({}); choose a "
                                            "port that is free.",
                                            options.port, std::strerror(errno))};
  }
  return server;
}

HttpServer::~HttpServer() {
  if (daemon_ == nullptr) return;
  for (auto& [key, connection] : connections_)
    give_up(*connection);
  MHD_run(daemon_);  // a suspended connection must not be there when it stops
  MHD_stop_daemon(daemon_);
}

int HttpServer::fd() const {
  return MHD_get_daemon_info(daemon_, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
}

int HttpServer::port() const {
  const auto* info = MHD_get_daemon_info(daemon_, MHD_DAEMON_INFO_BIND_PORT);
  return info == nullptr ? options_.port : info->port;
}

void HttpServer::run() {
  MHD_run(daemon_);
}

int HttpServer::wait_ms() const {
  MHD_UNSIGNED_LONG_LONG wait = kLongestWaitMs;
  if (MHD_get_timeout(daemon_, &wait) != MHD_YES) return kLongestWaitMs;
  return static_cast<int>(std::min<MHD_UNSIGNED_LONG_LONG>(wait, kLongestWaitMs));
}

void HttpServer::broadcast(const Event& event, const ShownRig* rig) {
  for (auto& [key, connection] : connections_) {
    if (connection->rig == rig) offer(*connection, event);
  }
}

void HttpServer::broadcast_to_all(const Event& event) {
  for (auto& [key, connection] : connections_)
    offer(*connection, event);
}

void HttpServer::offer(Connection& connection, const Event& event) {
  if (connection.given_up) return;
  if (!connection.browser.offer(event)) {
    ++figures_.given_up;
    give_up(connection);
  } else if (connection.suspended && !connection.browser.empty()) {
    connection.suspended = false;
    MHD_resume_connection(connection.http);
  }
}

// libmicrohttpd sees the end of the socket, and calls on_gone.
void HttpServer::give_up(Connection& connection) {
  connection.given_up = true;
  ::shutdown(socket_of(connection.http), SHUT_RDWR);
  if (std::exchange(connection.suspended, false)) MHD_resume_connection(connection.http);
}

MHD_Result HttpServer::on_request(void* self, MHD_Connection* connection, const char* url,
                                  const char* method, const char*, const char*, std::size_t* size,
                                  void** state) {
  static int begun;
  if (*state == nullptr) {  // the header has come
    *state = &begun;
    return MHD_YES;
  }
  if (*size > 0) {  // a body, which nobody wants
    *size = 0;
    return MHD_YES;
  }
  const char* host = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Host");
  try {
    return static_cast<HttpServer*>(self)->answer(connection,
                                                  {text_of(method), text_of(url), text_of(host)});
  } catch (const std::exception&) {  // for lack of memory: this connection is closed
    return MHD_NO;
  }
}

MHD_Result HttpServer::answer(MHD_Connection* connection, const PageRequest& request) {
  Reply reply = answer_to(request, rigs_, figures_);
  if (reply.events && request.method == "GET") return answer_events(connection, reply.rig);
  return send(connection, std::move(reply));
}

MHD_Result HttpServer::send(MHD_Connection* connection, Reply reply) {
  MHD_Response* response = nullptr;
  const bool report = reply.file && reply.file_name.empty();
  if (reply.file) {
    response = MHD_create_response_from_fd64(reply.file->bytes, reply.file->fd.get());
    if (response != nullptr) reply.file->fd.release();
  } else if (!reply.shared.empty()) {
    // Persistent memory is not written to.
    void* bytes = const_cast<char*>(reply.shared.data());
    response = MHD_create_response_from_buffer(reply.shared.size(), bytes, MHD_RESPMEM_PERSISTENT);
  } else {
    response = MHD_create_response_from_buffer(reply.body.size(), reply.body.data(),
                                               MHD_RESPMEM_MUST_COPY);
  }
  if (response == nullptr) return MHD_NO;
  common_headers(response, reply, report);
  const MHD_Result queued = MHD_queue_response(connection, reply.status, response);
  MHD_destroy_response(response);
  return queued;
}

MHD_Result HttpServer::answer_events(MHD_Connection* connection, const ShownRig* rig) {
  if (connections_.size() >= options_.max_browsers) {
    Reply full;
    full.status = 503;
    full.body = fmt::format("{} browsers look on already, and that is the limit; close one.\n",
                            options_.max_browsers);
    return send(connection, std::move(full));
  }
  ::setsockopt(socket_of(connection), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
  const std::vector<Event> opening = rig == nullptr ? std::vector{rigs_.overview_event()}
                                                    : rig->feed.opening(last_event_id(connection));
  auto owned = std::unique_ptr<Connection>(
      new Connection{this, rig, connection, Browser(options_.max_waiting, opening)});
  Connection* key = owned.get();
  MHD_Response* response = MHD_create_response_from_callback(
      MHD_SIZE_UNKNOWN, kBlock, &HttpServer::on_read, key, &HttpServer::on_gone);
  if (response == nullptr) return MHD_NO;
  connections_.emplace(key, std::move(owned));
  figures_.browsers = static_cast<int>(connections_.size());
  Reply reply;
  reply.type = "text/event-stream";
  common_headers(response, reply, false);
  header(response, "X-Accel-Buffering", "no");  // for nginx in front
  const MHD_Result queued = MHD_queue_response(connection, MHD_HTTP_OK, response);
  MHD_destroy_response(response);  // on_gone follows when the last user has left
  return queued;
}

ssize_t HttpServer::on_read(void* connection, std::uint64_t, char* to, std::size_t size) {
  auto& self = *static_cast<Connection*>(connection);
  if (self.given_up) return MHD_CONTENT_READER_END_WITH_ERROR;
  const std::size_t count = self.browser.read(to, size);
  if (count > 0) return static_cast<ssize_t>(count);
  self.suspended = true;
  MHD_suspend_connection(self.http);
  return 0;
}

void HttpServer::on_gone(void* connection) {
  auto* self = static_cast<Connection*>(connection);
  HttpServer& server = *self->server;
  server.connections_.erase(self);
  server.figures_.browsers = static_cast<int>(server.connections_.size());
}

}  // namespace shaker::gateway
