// HTTP on loopback, by libmicrohttpd with an epoll descriptor that the caller's loop watches.
//
// Every browser that asks for /events gets the opening of its rig's feed and then every event of that
// rig; for /events of all rigs it gets their list again and again. Nobody waits for a browser: each has a bounded queue (Browser) and is given up when that is full. One thread.
#pragma once

#include <map>
#include <memory>
#include <microhttpd.h>
#include <string>

#include "base/result.hpp"
#include "gateway/browser.hpp"
#include "gateway/page_request.hpp"

namespace shaker::gateway {

struct HttpOptions {
  int port = 8420;     // on 127.0.0.1; 0: any free one
  int listening = -1;  // a listening socket from systemd instead; the server closes it
  std::size_t max_waiting = 1024 * 1024;  // bytes for one browser
  unsigned max_browsers = 128;
};

class HttpServer {
 public:
  // An Error says that the port is taken. `rigs` outlives the server.
  static Result<std::unique_ptr<HttpServer>> make(const HttpOptions& options, const Rigs& rigs);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int fd() const;    // readable when run() has work
  int port() const;  // that the kernel chose
  // Serves what is ready. Call it also when wait_ms() has passed.
  void run();
  int wait_ms() const;  // at most a second
  // To those who look at `rig`; null: at the list of all.
  void broadcast(const Event& event, const ShownRig* rig);
  void broadcast_to_all(const Event& event);
  const GatewayFigures& figures() const { return figures_; }

 private:
  struct Connection;
  HttpServer(const HttpOptions& options, const Rigs& rigs);
  MHD_Result answer(MHD_Connection* connection, const PageRequest& request);
  MHD_Result answer_events(MHD_Connection* connection, const ShownRig* rig);
  void offer(Connection& connection, const Event& event);
  MHD_Result send(MHD_Connection* connection, Reply reply);
  void give_up(Connection& connection);
  static MHD_Result on_request(void* self, MHD_Connection* connection, const char* url,
                               const char* method, const char* version, const char* data,
                               std::size_t* size, void** state);
  static ssize_t on_read(void* connection, std::uint64_t position, char* to, std::size_t size);
  static void on_gone(void* connection);

  HttpOptions options_;
  const Rigs& rigs_;
  GatewayFigures figures_;
  std::map<Connection*, std::unique_ptr<Connection>> connections_;  // of /events
  MHD_Daemon* daemon_ = nullptr;
};

}  // namespace shaker::gateway
