// stop, estop, ack: one request, one answer.
#include <fmt/format.h>

#include "cli/commands/daemon_error.hpp"

namespace shaker::cli {
namespace {

const char* done(const std::string& method) {
  if (method == "stop") return "The rig ramps down.";
  if (method == "estop")
    return "Emergency stop: the exciter is ordered to zero; the fault is latched "
           "until `shakerctl ack`.";
  return "The fault is acknowledged.";
}

}  // namespace

int order(const Common& common, const std::string& method) {
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  const auto answer = client->ask(method);
  if (!answer) return unreachable(common, answer.error());
  if (answer->refused) return refused(common, *answer);
  if (common.json) {
    fmt::print("{}\n", answer->result.dump());
  } else {
    const std::string state = answer->result.is_object() ? text_of(answer->result, "state") : "";
    if (method == "stop" && state == "IDLE") {
      fmt::print("Nothing was moving. State: IDLE.\n");
      return kOk;
    }
    const bool still = method == "ack" && state == "FAULT";
    fmt::print("{}{}\n", still ? "The exciter is told to clear its own fault." : done(method),
               state.empty() ? "" : " State: " + printable(state) + ".");
  }
  return kOk;
}

}  // namespace shaker::cli
