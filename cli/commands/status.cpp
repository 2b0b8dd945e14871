// Shows the state of the rig: the snapshot that every client gets, and the answer to `status`.
#include <fmt/format.h>

#include "cli/commands/daemon_error.hpp"
#include "cli/utc_text.hpp"
#include "protocol/standing_alarms.hpp"
#include "report/estimate_table.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;

std::string control_line(const Json& answer) {
  const std::string who = text_of(answer, "controller");
  if (who.empty()) return "control: free";
  return fmt::format("control: {}, for {}", printable(who),
                     report::duration(number_of(answer, "controlled_for_s").value_or(0.0)));
}

void print_alarms(const protocol::StandingAlarms& alarms) {
  for (const protocol::StandingAlarm& alarm : alarms.by_severity())
    fmt::print("{} since {}: {}\n", alarm.error ? "ALARM" : "warning",
               readable_utc(alarm.since_utc), printable(alarm.text));
}

void print(const Json& version, const Json& answer, const Json& state, const Json& estimate,
           const protocol::StandingAlarms& alarms) {
  fmt::print("rig {}   {} {}\n", printable(text_of(version, "rig")),
             printable(text_of(version, "program")), printable(text_of(version, "version")));
  fmt::print("{}\n", narrate(state));
  print_alarms(alarms);
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
  if (frequency && amplitude && *frequency > 0.0)
    fmt::print("setpoint {:.4g} Hz, {:.4g} m/s^2\n", *frequency, *amplitude);
  fmt::print("{}\n", control_line(answer));
  if (!estimate.is_null()) {
    fmt::print("\nlast estimate, of campaign {} at {}, {}",
               printable(text_of(estimate, "campaign")), readable_utc(text_of(estimate, "t_utc")),
               report::estimate_table(estimate_from(estimate)));
  }
}

}  // namespace

int status(const Common& common) {
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  Json estimate;
  protocol::StandingAlarms alarms;
  const auto answer = client->ask("status", nullptr, [&](const std::string& line) {
    Json document = Json::parse(line, nullptr, false);
    alarms.take(document, line);
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
    body["alarms"] = nlohmann::ordered_json::array();
    for (const protocol::StandingAlarm& alarm : alarms.by_severity())
      body["alarms"].push_back(nlohmann::ordered_json::parse(alarm.line, nullptr, false));
    if (answer->result.contains("controller")) body["controller"] = answer->result["controller"];
    if (!estimate.is_null()) body["estimate"] = estimate;
    fmt::print("{}\n", body.dump());
  } else {
    print(client->version(), answer->result, state, estimate, alarms);
  }
  return text_of(state, "state") == "FAULT" ? kNegative : kOk;
}

}  // namespace shaker::cli
