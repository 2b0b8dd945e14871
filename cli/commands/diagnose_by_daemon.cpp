// `shakerctl diagnose --daemon`: the daemon runs the diagnosis, on the machine with the
// campaign.
#include <cstdio>

#include <fmt/format.h>

#include "cli/commands/daemon_error.hpp"
#include "cli/terminal.hpp"
#include "config/model.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;

Result<Json> request_of(const DiagnoseCommandOptions& options) {
  Json request = {{"false_alarm_rate", options.false_alarm_rate}};
  if (options.thorough) request["thorough"] = true;
  if (!options.campaigns.empty()) request["campaign"] = options.campaigns.front().string();
  if (!options.out.empty()) request["out"] = options.out.string();
  if (options.model.empty()) return request;
  const auto model = config::load_model(options.model);
  if (!model) return model.error();
  request["model"] = Json::parse(config::to_json_text(*model));
  return request;
}

void draw(const Json& progress) {
  fmt::print(stderr, "\r{:<24} {}\x1b[K", printable(text_of(progress, "stage")),
             progress_bar(number_of(progress, "share").value_or(0.0), 30));
  std::fflush(stderr);
}

std::string parameter_line(const Json& p) {
  const auto value = number_of(p, "value"), error = number_of(p, "standard_error");
  return fmt::format("  {} = {} {}{}\n", printable(text_of(p, "name")),
                     value ? fmt::format("{:.5g}", *value) : "-", printable(text_of(p, "unit")),
                     error ? fmt::format("  (standard error {:.2g})", *error) : "");
}

void print(const Json& result) {
  fmt::print("{}\n", printable(text_of(result, "reason")));
  const Json none = Json::object();
  const Json& diagnosis = result.contains("diagnosis") ? result["diagnosis"] : none;
  for (const Json& effect : diagnosis.value("effects", Json::array())) {
    fmt::print("{}: probability {:.3f}\n", printable(text_of(effect, "name")),
               number_of(effect, "probability").value_or(0.0));
    for (const Json& parameter : effect.value("parameters", Json::array()))
      fmt::print("{}", parameter_line(parameter));
    for (const Json& other : effect.value("confusable_with", Json::array()))
      fmt::print("  cannot be told from {} here\n", printable(other.get<std::string>()));
  }
  for (const Json& warning : diagnosis.value("warnings", Json::array()))
    fmt::print("note: {}\n", printable(warning.get<std::string>()));
  fmt::print("files: {}\n", printable(text_of(result, "folder")));
}

// Waits for the document of the result. Ctrl-C asks the daemon to cancel; a second one leaves
// at once.
Result<Json> follow(StreamClient& client, const std::string& database) {
  bool asked_to_end = false;
  const bool drawing = stdout_is_terminal();
  for (;;) {
    if (interrupts() > 1) return Error{ErrorKind::refused, "left before the diagnosis had ended"};
    if (interrupts() > 0 && !asked_to_end) {
      asked_to_end = true;
      if (auto sent = client.send("diagnose.cancel"); !sent) return sent.error();
    }
    std::string line;
    const auto wait = client.next(100, line);
    if (!wait) return wait.error();
    if (*wait != StreamClient::Wait::line) continue;
    Json document = Json::parse(line, nullptr, false);
    const std::string type = text_of(document, "type");
    if (type == "diagnosis_progress" && drawing) draw(document);
    if (type != "diagnosis_result" || text_of(document, "database") != database) continue;
    if (drawing) fmt::print(stderr, "\r\x1b[K");
    return document;
  }
}

}  // namespace

int diagnose_by_daemon(const Common& common, const DiagnoseCommandOptions& options) {
  const auto request = request_of(options);
  if (!request) return fail(common, kBadInput, request.error().what);
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  count_interrupts();
  // The answer comes before the first document of the diagnosis, so no document is lost here.
  const auto answer = client->ask("diagnose", *request);
  if (!answer) return unreachable(common, answer.error());
  if (answer->refused) return refused(common, *answer);
  const auto result = follow(*client, text_of(answer->result, "database"));
  if (!result) return unreachable(common, result.error());
  if (text_of(*result, "status") != "done")
    return fail(common, kNotUsable, printable(text_of(*result, "reason")));
  if (common.json) {
    fmt::print("{}\n", result->value("diagnosis", Json::object()).dump(2));
  } else {
    print(*result);
  }
  return kOk;
}

}  // namespace shaker::cli
