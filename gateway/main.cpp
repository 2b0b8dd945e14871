// shakerd-gateway: shows rigs to browsers. It reads the daemons' sockets and cannot command.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <systemd/sd-daemon.h>

#include "base/clock.hpp"
#include "cli/serving_program.hpp"
#include "gateway/http_server.hpp"

namespace shaker::gateway {
namespace {

using cli::DaemonLink;
using cli::DaemonLinks;

struct Options {
  std::filesystem::path data;
  std::filesystem::path folder;        // of the sockets of several rigs; may be empty
  std::vector<std::string> rig_words;  // NAME=SOCKET
  std::vector<RigSocket> rigs;
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
  CLI::Option* socket = app.get_option("--socket");
  app.add_option("--rig", options.rig_words,
                 "NAME=SOCKET: one of several rigs; its campaigns are in DIR/NAME of --data")
      ->excludes(socket);
  app.add_option("--rigs", options.folder,
                 "Every rig whose socket is in this folder, NAME/view.sock; view.sock itself is "
                 "that of the rig shakerd, whose campaigns are in DIR")
      ->type_name("DIR")
      ->excludes(socket)
      ->excludes("--rig");
  app.add_option("--max-waiting", options.http.max_waiting,
                 "Bytes that may wait for one browser; one that does not read is then given up")
      ->type_name("BYTES")
      ->check(CLI::Range(16'384, 1'000'000'000))
      ->capture_default_str();
}

// Names and sockets of --rig.
Result<void> check(Options& options) {
  for (const std::string& text : options.rig_words) {
    auto rig = rig_socket(text);
    if (!rig) return rig.error();
    const auto same = [&](const RigSocket& other) {
      return other.name == rig->name || other.socket == rig->socket;
    };
    if (std::ranges::any_of(options.rigs, same))
      return Error{ErrorKind::invalid,
                   fmt::format("--rig {}: another --rig has this name or socket", text)};
    options.rigs.push_back(*std::move(rig));
  }
  return {};
}

std::filesystem::path data_of(const Options& options, const std::string& rig) {
  const bool below = !options.data.empty() && rig != kOnlyRig;
  return below ? options.data / rig : options.data;
}

class Gateway {
 public:
  Gateway(const Options& options, DaemonLinks& links, Rigs& rigs, HttpServer& http)
      : options_(options), links_(links), rigs_(rigs), http_(http), began_(clock_.utc()) {}

  void show(const std::string& name, const std::filesystem::path& data, DaemonLink& link) {
    feeders_.push_back({&rigs_.add(name, data), &link});
  }

  // Until a signal comes.
  void serve(int signals) {
    while (true) {
      std::vector<pollfd> ready = {{signals, POLLIN, 0}, {http_.fd(), POLLIN, 0}};
      for (const Feeder& feeder : feeders_)
        ready.push_back({feeder.link->fd(), POLLIN, 0});
      ::poll(ready.data(), ready.size(), http_.wait_ms());
      if ((ready[0].revents & POLLIN) != 0) return;
      for (Feeder& feeder : feeders_) {
        for (auto& news : feeder.link->take())
          on_news(feeder, news);
      }
      beat();
      http_.run();
    }
  }

  // Shows the rigs that have come into the folder. One that was there stays, and is away.
  void look_for_rigs() {
    bool more = false;
    for (const RigSocket& found : rig_sockets_in(options_.folder)) {
      if (rigs_.find(found.name) != nullptr) continue;
      more = true;
      show(found.name, data_of(options_, found.name), links_.add(found.socket));
      fmt::print(stderr, "The rig {} is at {}.\n", found.name, found.socket.string());
    }
    // Browsers at the root may look at something else from now on.
    if (more) http_.broadcast_to_all(rigs_.overview_event());
  }

 private:
  struct Feeder {
    ShownRig* rig;
    DaemonLink* link;
  };

  void on_news(Feeder& feeder, const DaemonLink::News& news) {
    Feed& feed = feeder.rig->feed;
    if (news.kind == DaemonLink::News::Kind::line) {
      if (const auto event = feed.take(news.text)) http_.broadcast(*event, feeder.rig);
    } else if (news.kind == DaemonLink::News::Kind::lost) {
      if (feed.lost() != news.text) say(feeder, news.text);
      http_.broadcast(feed.lose(news.text), feeder.rig);
    } else {
      say(feeder, "The daemon answers.");
      feed.begin(fmt::format("{}-{}", began_.count(), ++lives_));
      for (const Event& event : feed.opening(std::nullopt))
        http_.broadcast(event, feeder.rig);
    }
  }

  void say(const Feeder& feeder, const std::string& sentence) const {
    const std::string of = feeders_.size() > 1 ? feeder.rig->name + ": " : "";
    fmt::print(stderr, "{}{}\n", of, sentence);
  }

  // A browser that hears nothing for a few seconds knows that the gateway is gone.
  void beat() {
    if (clock_.now() < next_beat_) return;
    next_beat_ = clock_.now() + kBeat;
    if (!options_.folder.empty()) look_for_rigs();
    http_.broadcast(rigs_.overview_event(), nullptr);
    http_.broadcast_to_all({event_text("{}", 0, "beat")});
    ::sd_notify(0, "WATCHDOG=1");
  }

  const Options& options_;
  RealClock clock_;
  DaemonLinks& links_;
  Rigs& rigs_;
  HttpServer& http_;
  std::vector<Feeder> feeders_;
  Nanoseconds began_, next_beat_{};
  int lives_ = 0;
};

// A folder may come later; a slip in its name does not.
void say_what_is_missing(const Options& options) {
  const auto missing = [](const std::filesystem::path& folder) {
    std::error_code none;
    return !folder.empty() && !std::filesystem::is_directory(folder, none);
  };
  if (missing(options.data))
    fmt::print(stderr, "--data {}: there is no such folder, so the page offers no campaigns yet.\n",
               options.data.string());
  if (missing(options.folder))
    fmt::print(stderr, "--rigs {}: there is no such folder, so the page shows no rig yet.\n",
               options.folder.string());
}

Result<void> serve(const Options& options, DaemonLinks& links, int ending) {
  Rigs rigs;
  auto http = HttpServer::make(options.http, rigs);
  if (!http) return http.error();
  Gateway gateway(options, links, rigs, **http);
  if (!options.folder.empty()) {
    gateway.look_for_rigs();
  } else if (options.rigs.empty()) {
    gateway.show(kOnlyRig, options.data, links.own());
  }
  for (const RigSocket& rig : options.rigs)
    gateway.show(rig.name, data_of(options, rig.name), links.add(rig.socket));
  fmt::print("The page is at http://127.0.0.1:{}/\n", (*http)->port());
  std::fflush(stdout);
  say_what_is_missing(options);
  ::sd_notify(0, "READY=1");
  gateway.serve(ending);
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
           "shakerd-gateway shows the rigs of shakerd to browsers on this PC: state, alarms, the "
           "last cycle over the\nmodel's, how the estimate converges. It reads the daemon's stream "
           "and cannot command.",
       .reader = "The gateway",
       .documents = {"wave", "scope", "rig"},
       .add_options = [&options](CLI::App& app) { add_options(app, options); },
       .check = [&options] { return check(options); },
       .serve = [&options](shaker::cli::DaemonLinks& links,
                           int ending) { return serve(options, links, ending); }},
      argc, argv);
}
