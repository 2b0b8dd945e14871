#include "mqtt/relay.hpp"

#include <algorithm>

namespace shaker::mqtt {
namespace {

using Json = nlohmann::json;

std::string word_of(const Json& document, const char* key) {
  const auto found = document.find(key);
  return found != document.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::int64_t whole_number_of(const Json& document, const char* key, std::int64_t otherwise) {
  const auto found = document.find(key);
  return found != document.end() && found->is_number_integer() ? found->get<std::int64_t>()
                                                               : otherwise;
}

}  // namespace

void Relay::connected() {
  alarms_ = {};
  known_ = newest_;
}

std::optional<std::string> Relay::take(const std::string& line, Nanoseconds now) {
  const Json document = Json::parse(line, nullptr, false);
  if (!document.is_object()) return std::nullopt;
  const std::string type = word_of(document, "type");
  if (type == "version") {
    outbox_.say("online");
    return word_of(document, "rig");
  }
  const Nanoseconds made(whole_number_of(document, "t_mono_ns", now.count()));
  if (type == "state") outbox_.put(Kind::state, {line, made});
  if (type == "estimate") outbox_.put(Kind::estimate, {line, made});
  if (type == "alarm") take_alarm(document, line, made);
  if (type == "health") {
    const std::string text = line.substr(0, line.rfind('}'));
    outbox_.put(Kind::health, {text + ",\"alarms_standing\":" + standing() + "}", made});
  }
  return std::nullopt;
}

void Relay::take_alarm(const Json& alarm, const std::string& line, Nanoseconds made) {
  alarms_.take(alarm);
  const Order order{made.count(), static_cast<std::uint64_t>(whole_number_of(alarm, "seq", 0))};
  if (order <= known_) return;
  newest_ = std::max(newest_, order);
  outbox_.put(Kind::alarm, {line, made});
}

std::string Relay::standing() const {
  Json list = Json::array();
  for (const protocol::StandingAlarm& one : alarms_.all()) {
    list.push_back({{"code", one.code},
                    {"severity", one.error ? "error" : "warning"},
                    {"since_utc", one.since_utc},
                    {"text", one.text}});
  }
  return list.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace shaker::mqtt
