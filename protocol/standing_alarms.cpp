#include "protocol/standing_alarms.hpp"

#include <algorithm>

namespace shaker::protocol {
namespace {

std::string member(const nlohmann::json& document, const char* key) {
  const auto at = document.find(key);
  return at != document.end() && at->is_string() ? at->get<std::string>() : std::string();
}

}  // namespace

bool StandingAlarms::take(const nlohmann::json& document, std::string_view line) {
  if (!document.is_object() || member(document, "type") != "alarm") return false;
  const std::string severity = member(document, "severity");
  StandingAlarm alarm{member(document, "code"), member(document, "text"), member(document, "t_utc"),
                      severity == "error"};
  if (severity == "info") {
    if (alarm.code == kAcknowledged) all_.clear();
    if (alarm.code == kWarningsSetAside)
      std::erase_if(all_, [](const StandingAlarm& one) { return !one.error; });
    return false;
  }
  if (severity != "error" && severity != "warning") return false;
  const bool of_a_file = alarm.code.starts_with("campaign_");
  for (StandingAlarm& known : all_) {
    if (known.code != alarm.code || known.error != alarm.error) continue;
    if (of_a_file && known.text != alarm.text) continue;
    known.text = alarm.text;
    ++known.times;
    return alarm.error;
  }
  make_room();
  alarm.line = line;
  all_.push_back(std::move(alarm));
  return all_.back().error;
}

std::deque<StandingAlarm> StandingAlarms::by_severity() const {
  std::deque<StandingAlarm> sorted = all_;
  std::ranges::stable_sort(
      sorted, [](const StandingAlarm& a, const StandingAlarm& b) { return a.error && !b.error; });
  return sorted;
}

void StandingAlarms::make_room() {
  if (all_.size() < kMost) return;
  const auto warning =
      std::ranges::find_if(all_, [](const StandingAlarm& one) { return !one.error; });
  all_.erase(warning == all_.end() ? all_.begin() : warning);
}

}  // namespace shaker::protocol
