// shakerd-mqtt: publishes the rig to an MQTT broker. It reads the daemon's socket and cannot
// command.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include "base/clock.hpp"
#include "cli/serving_program.hpp"
#include "mqtt/broker_link.hpp"
#include "mqtt/password_file.hpp"
#include "mqtt/relay.hpp"

namespace shaker::mqtt {
namespace {

using cli::DaemonLink;

struct Options {
  std::string prefix = "shaker", rig;
  std::filesystem::path password_file;
  BrokerOptions broker;
};

constexpr int kTurnMs = 500;
constexpr Nanoseconds kGoodbye = std::chrono::seconds(1);

void add_options(CLI::App& app, Options& options) {
  app.add_option("--broker", options.broker.host, "Name or address of the broker")
      ->type_name("HOST")
      ->capture_default_str();
  options.broker.port = 0;
  app.add_option("--port", options.broker.port, "Port of the broker [1883; with --ca-file 8883]")
      ->type_name("PORT")
      ->check(CLI::Range(1, 65535));
  auto* user = app.add_option("--user", options.broker.user, "Name to log in with")  //
                   ->type_name("NAME");
  app.add_option("--password-file", options.password_file,
                 "File whose first line is the password; others may not read it")
      ->type_name("FILE")
      ->needs(user);
  app.add_option("--ca-file", options.broker.ca_file,
                 "Certificates (PEM) that vouch for the broker; switches TLS on")
      ->type_name("FILE");
  app.add_option("--prefix", options.prefix, "Where the topics begin")
      ->type_name("PREFIX")
      ->capture_default_str();
  app.add_option("--rig", options.rig, "Name in the topics [the rig's own, as the daemon says it]")
      ->type_name("RIG");
}

Error bad(const std::string& sentence) {
  return {ErrorKind::invalid, sentence};
}

Result<void> check(Options& options) {
  if (options.broker.host.empty()) return bad("--broker is empty; name the broker");
  if (options.broker.port == 0) options.broker.port = options.broker.ca_file.empty() ? 1883 : 8883;
  if (const auto good = check_prefix(options.prefix); !good)
    return bad("--prefix " + good.error().what);
  if (!options.rig.empty() && topic_level(options.rig) != options.rig)
    return bad(fmt::format("--rig \"{}\" is no level of a topic; write \"{}\"", options.rig,
                           topic_level(options.rig)));
  if (const std::string& ca = options.broker.ca_file;
      !ca.empty() && ::access(ca.c_str(), R_OK) != 0)
    return bad(fmt::format("--ca-file {}: {}", ca, std::strerror(errno)));
  if (options.password_file.empty()) return {};
  auto password = read_password(options.password_file);
  if (!password) return bad("--password-file " + password.error().what);
  options.broker.password = *std::move(password);
  return {};
}

class Bridge {
 public:
  explicit Bridge(const Options& options)
      : options_(options), relay_(outbox_), broker_(options.broker, outbox_, clock_) {
    if (!options.rig.empty()) speak_for(options.rig);
  }

  // Until a signal comes.
  void serve(DaemonLink& link, int signals) {
    while (true) {
      pollfd ready[] = {broker_.waits_for(), {link.fd(), POLLIN, 0}, {signals, POLLIN, 0}};
      ::poll(ready, 3, kTurnMs);
      if ((ready[2].revents & POLLIN) != 0) break;
      for (const auto& news : link.take())
        on_news(news);
      tell_dropped();
      broker_.run();
      ::sd_notify(0, "WATCHDOG=1");
    }
    broker_.leave(kGoodbye);
  }

 private:
  void on_news(const DaemonLink::News& news) {
    switch (news.kind) {
      case DaemonLink::News::Kind::connected:
        fmt::print(stderr, "The daemon answers.\n");
        lost_.clear();
        relay_.connected();
        break;
      case DaemonLink::News::Kind::lost:
        if (lost_ != news.text) fmt::print(stderr, "{}\n", news.text);
        lost_ = news.text;
        relay_.lost();
        break;
      case DaemonLink::News::Kind::line:
        if (const auto rig = relay_.take(news.text, clock_.now()); rig && options_.rig.empty())
          speak_for(topic_level(*rig));
    }
  }

  void speak_for(const std::string& rig) {
    if (rig == rig_) return;
    if (broker_.speaks()) {
      fmt::print(stderr,
                 "The rig is {} now, and no longer {}. Alarms of {} that were not sent: {}.\n", rig,
                 rig_, rig_, outbox_.alarms_waiting());
      broker_.leave(kGoodbye);
      outbox_ = Outbox();
      told_dropped_ = 0;
      outbox_.say("online");
    }
    rig_ = rig;
    const std::string base = options_.prefix + "/" + rig;
    fmt::print(stderr, "The topics are {}/bridge, alarm, state, estimate, health.\n", base);
    broker_.speak_for(base);
  }

  void tell_dropped() {
    const std::uint64_t dropped = outbox_.alarms_dropped();
    if (dropped <= told_dropped_) return;
    fmt::print(stderr, "{} alarms were dropped, the oldest first: the broker is away too long.\n",
               dropped - told_dropped_);
    told_dropped_ = dropped;
  }

  const Options& options_;
  RealClock clock_;
  Outbox outbox_;
  Relay relay_;
  BrokerLink broker_;
  std::string rig_, lost_;
  std::uint64_t told_dropped_ = 0;
};

}  // namespace
}  // namespace shaker::mqtt

int main(int argc, char** argv) {
  using namespace shaker::mqtt;
  Options options;
  std::optional<Bridge> bridge;  // there to the end: its attempt to connect may still be under way
  return shaker::cli::run_serving_program(
      {.name = "shakerd-mqtt",
       .about =
           "shakerd-mqtt publishes the rig of shakerd to an MQTT broker: state, estimate, alarm "
           "and health,\nretained, each with its age, below PREFIX/RIG. It reads the daemon's "
           "stream and cannot command.",
       .reader = "The bridge",
       .add_options = [&options](CLI::App& app) { add_options(app, options); },
       .check = [&options] { return check(options); },
       .serve =
           [&options, &bridge](shaker::cli::DaemonLinks& links, int ending) {
             bridge.emplace(options);
             ::sd_notify(0, "READY=1");
             bridge->serve(links.own(), ending);
             return shaker::Result<void>();
           }},
      argc, argv);
}
