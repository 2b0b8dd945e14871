// Shows the state of the rig: the snapshot that every client gets, and the answer to `status`.
#include <fmt/format.h>

#include "cli/commands/daemon_error.hpp"
#include "report/estimate_table.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;

void print(const Json& version, const Json& state, const Json& estimate) {
  fmt::print("rig {}   {} {}\n", printable(text_of(version, "rig")),
             printable(text_of(version, "program")), printable(text_of(version, "version")));
  fmt::print("{}\n", narrate(state));
  if (state.contains("campaign")) {
    fmt::print("campaign {}", printable(text_of(state, "campaign")));
    if (state.contains("run")) fmt::print(", run {}", printable(text_of(state, "run")));
    if (const auto progress = number_of(state, "progress")) {
      fmt::print(", {:.0f} % done", 100.0 * *progress);
    }
    fmt::print("\n");
  }
  const auto frequency = number_of(state, "frequency_hz");
  const auto amplitude = number_of(state, "amplitude");
  if (frequency && amplitude)
    fmt::print("setpoint {:.4g} Hz, {:.4g} m/s^2\n", *frequency, *amplitude);
  fmt::print("control: {}\n", flag_of(state, "controlled") ? "held by a client" : "free");
  if (!estimate.is_null()) {
    fmt::print("\nlast estimate, {}", report::estimate_table(estimate_from(estimate)));
  }
}

}  // namespace

int status(const Common& common) {
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  Json estimate;
  const auto answer = client->ask("status", nullptr, [&](const std::string& line) {
    Json document = Json::parse(line, nullptr, false);
    if (document.is_object() && text_of(document, "type") == "estimate") {
      estimate = std::move(document);
    }
  });
  if (!answer) return unreachable(common, answer.error());
  if (answer->refused) return refused(common, *answer);
  Json state = answer->result.is_object() ? answer->result.value("state", Json()) : Json();
  if (!state.is_object()) return fail(common, kUnreachable, "the daemon's answer holds no state");
  state["type"] = "state";
  if (common.json) {
    nlohmann::ordered_json body = {{"version", client->version()}, {"state", state}};
    if (!estimate.is_null()) body["estimate"] = estimate;
    fmt::print("{}\n", body.dump());
  } else {
    print(client->version(), state, estimate);
  }
  return text_of(state, "state") == "FAULT" ? kNegative : kOk;
}

}  // namespace shaker::cli
