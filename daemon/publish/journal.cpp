#include "daemon/publish/journal.hpp"

#include <variant>

#include <spdlog/spdlog.h>

namespace shaker::daemon {

void log_document(const protocol::Document& document, std::string& last) {
  if (const auto* alarm = std::get_if<protocol::AlarmDocument>(&document)) {
    const auto level = alarm->severity == "error"     ? spdlog::level::err
                       : alarm->severity == "warning" ? spdlog::level::warn
                                                      : spdlog::level::info;
    spdlog::log(level, "{}: {}", alarm->code, alarm->text);
  } else if (const auto* state = std::get_if<protocol::StateDocument>(&document)) {
    const std::string line = state->state + ": " + state->reason;
    if (line != last) spdlog::info("{}", line);
    last = line;
  } else if (const auto* stop = std::get_if<protocol::RunStopDocument>(&document)) {
    spdlog::info("Run {} of {} ended: {}, {}", stop->run, stop->campaign, stop->status,
                 stop->reason);
  } else if (const auto* found = std::get_if<protocol::DiagnosisResultDocument>(&document)) {
    spdlog::info("Diagnosis of {}: {}, {}", found->campaign, found->status, found->reason);
  }
}

}  // namespace shaker::daemon
