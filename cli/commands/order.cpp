// stop, pause, estop, ack: sends one request and prints the answer.
#include <chrono>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "cli/commands/daemon_error.hpp"

namespace shaker::cli {
namespace {

const char* done(const std::string& method) {
  if (method == "stop") return "The rig ramps down.";
  if (method == "pause") return "The rig ramps to rest; `shakerctl resume` goes on.";
  if (method == "estop")
    return "Emergency stop: the exciter is ordered to zero; the fault is latched "
           "until `shakerctl ack`.";
  return "Acknowledged.";
}

// Repeats the request for 5 s when the daemon has no free place, or when the connection is lost
// before the answer. The daemon keeps places for commands, but other clients may compete for
// them.
Result<Answer> insist(const Common& common, const std::string& method) {
  using namespace std::chrono_literals;
  const auto until = std::chrono::steady_clock::now() + 5s;
  std::optional<Error> lost;
  for (;;) {
    auto client = StreamClient::connect(common.socket);
    if (!client && client.error().kind != ErrorKind::exhausted)
      return lost.value_or(client.error());
    const auto answer = client ? client->ask(method) : Result<Answer>(client.error());
    if (answer || std::chrono::steady_clock::now() > until) return answer;
    lost = answer.error();
    std::this_thread::sleep_for(50ms);
  }
}

}  // namespace

int order(const Common& common, const std::string& method) {
  const auto answer = insist(common, method);
  if (!answer) return unreachable(common, answer.error());
  if (answer->refused) return refused(common, *answer);
  if (common.json) {
    fmt::print("{}\n", answer->result.dump());
  } else {
    const std::string state = answer->result.is_object() ? text_of(answer->result, "state") : "";
    if (method == "stop" && (state == "IDLE" || state == "FAULT")) {
      fmt::print("Nothing was moving. State: {}.\n", state);
      return kOk;
    }
    const bool still = method == "ack" && state == "FAULT";
    fmt::print("{}{}\n", still ? "The exciter is told to clear its own fault." : done(method),
               state.empty() ? "" : " State: " + printable(state) + ".");
  }
  return kOk;
}

}  // namespace shaker::cli
