// shakerd-gateway: shows the rig to browsers. It reads the daemon's socket and cannot command.
#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <poll.h>
#include <systemd/sd-daemon.h>

#include "base/clock.hpp"
#include "cli/serving_program.hpp"
#include "gateway/http_server.hpp"

namespace shaker::gateway {
namespace {

using cli::DaemonLink;

struct Options {
  std::filesystem::path data;
  HttpOptions http;
};

constexpr Nanoseconds kBeat = std::chrono::seconds(1);

void add_options(CLI::App& app, Options& options) {
  app.add_option("--port", options.http.port,
                 "Port on 127.0.0.1 (0: any free one). Ignored when systemd hands a socket over.")
      ->type_name("PORT")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  app.add_option("--data", options.data,
                 "The daemon's directory, to download campaigns and reports from; empty: none")
      ->type_name("DIR");
  app.add_option("--max-waiting", options.http.max_waiting,
                 "Bytes that may wait for one browser; one that does not read is then given up")
      ->type_name("BYTES")
      ->check(CLI::Range(16'384, 1'000'000'000))
      ->capture_default_str();
}

class Gateway {
 public:
  Gateway(DaemonLink& link, Feed& feed, HttpServer& http)
      : link_(link), feed_(feed), http_(http), began_(clock_.utc()) {}

  // Until a signal comes.
  void serve(int signals) {
    while (true) {
      pollfd ready[] = {{http_.fd(), POLLIN, 0}, {link_.fd(), POLLIN, 0}, {signals, POLLIN, 0}};
      ::poll(ready, 3, http_.wait_ms());
      if ((ready[2].revents & POLLIN) != 0) return;
      for (auto& news : link_.take())
        on_news(news);
      beat();
      http_.run();
    }
  }

 private:
  void on_news(const DaemonLink::News& news) {
    if (news.kind == DaemonLink::News::Kind::line) {
      if (const auto event = feed_.take(news.text)) http_.broadcast(*event);
    } else if (news.kind == DaemonLink::News::Kind::lost) {
      if (feed_.lost() != news.text) fmt::print(stderr, "{}\n", news.text);
      http_.broadcast(feed_.lose(news.text));
    } else {
      fmt::print(stderr, "The daemon answers.\n");
      feed_.begin(fmt::format("{}-{}", began_.count(), ++lives_));
      for (const Event& event : feed_.opening(std::nullopt))
        http_.broadcast(event);
    }
  }

  // A browser that hears nothing for a few seconds knows that the gateway is gone.
  void beat() {
    if (clock_.now() < next_beat_) return;
    next_beat_ = clock_.now() + kBeat;
    http_.broadcast({event_text("{}", 0, "beat")});
    ::sd_notify(0, "WATCHDOG=1");
  }

  RealClock clock_;
  DaemonLink& link_;
  Feed& feed_;
  HttpServer& http_;
  Nanoseconds began_, next_beat_{};
  int lives_ = 0;
};

Result<void> serve(const Options& options, DaemonLink& link, int ending) {
  Feed feed;
  const Downloads downloads(options.data);
  auto http = HttpServer::make(options.http, feed, downloads);
  if (!http) return http.error();
  fmt::print("The page is at http://127.0.0.1:{}/\n", (*http)->port());
  std::fflush(stdout);
  ::sd_notify(0, "READY=1");
  Gateway(link, feed, **http).serve(ending);
  return {};
}

}  // namespace
}  // namespace shaker::gateway

int main(int argc, char** argv) {
  using namespace shaker::gateway;
  Options options;
  if (::sd_listen_fds(1) > 0) options.http.listening = SD_LISTEN_FDS_START;
  return shaker::cli::run_serving_program(
      {.name = "shakerd-gateway",
       .about =
           "shakerd-gateway shows the rig of shakerd to browsers on this PC: state, alarms, the "
           "last cycle over the\nmodel's, how the estimate converges. It reads the daemon's stream "
           "and cannot command.",
       .reader = "The gateway",
       .documents = {"wave", "scope", "rig"},
       .add_options = [&options](CLI::App& app) { add_options(app, options); },
       .serve = [&options](DaemonLink& link, int ending) { return serve(options, link, ending); }},
      argc, argv);
}
