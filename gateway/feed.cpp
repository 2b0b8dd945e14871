#include "gateway/feed.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "protocol/standing_alarms.hpp"

namespace shaker::gateway {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxAlarms = 64;

// Documents with a number of which every one counts, until the next campaign.
const std::set<std::string>& kept_types() {
  static const std::set<std::string> types = {"cycle", "estimate", "run_start", "run_stop",
                                              "alarm"};
  return types;
}
// Documents without a number of their own.
bool is_unnumbered(const std::string& type) {
  return type == "version" || type == "wave" || type == "scope" || type == "rig";
}

std::string text_in(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

Text event_text(const std::string& data, std::uint64_t id, const std::string& name) {
  std::string text;
  if (id != 0) text += fmt::format("id: {}\n", id);
  if (!name.empty()) text += fmt::format("event: {}\n", name);
  text += "data: " + data + "\n\n";
  return std::make_shared<const std::string>(std::move(text));
}

void Feed::begin(const std::string& life) {
  const std::size_t bound = max_bytes_;
  *this = Feed(bound);
  life_ = life;
  lost_.clear();
}

Event Feed::lose(const std::string& why) {
  lost_ = why.empty() ? "The daemon is away." : why;
  return greeting();
}

Event Feed::greeting() const {
  const Json data = {{"life", life_}, {"connected", connected()}, {"why", lost_}};
  return {event_text(data.dump(-1, ' ', false, Json::error_handler_t::replace), 0, "daemon")};
}

const Json* Feed::last(const std::string& type) const {
  const auto found = last_.find(type);
  return found == last_.end() ? nullptr : &found->second;
}

int Feed::alarms(const std::string& severity) const {
  return static_cast<int>(std::ranges::count_if(history_, [&](const Kept& kept) {
    return kept.type == "alarm" && kept.severity == severity;
  }));
}

std::optional<Event> Feed::take(const std::string& line) {
  Json document = Json::parse(line, nullptr, false);
  if (!document.is_object()) return std::nullopt;
  const std::string type = text_in(document, "type");
  if (type.empty() || type == "missed") return std::nullopt;
  const auto number = document.find("seq");
  const bool numbered =
      number != document.end() && number->is_number_unsigned() && !is_unnumbered(type);
  const std::uint64_t seq = numbered ? number->get<std::uint64_t>() : 0;
  if (type == "version" && number != document.end() && number->is_number_unsigned())
    forgot_ = seq_ = number->get<std::uint64_t>();
  if (type == "state") take_state(document);
  if (type == "alarm") take_alarm(document);
  const Text text = event_text(line, seq);
  if (kept_types().contains(type)) {
    keep(document, type, seq, text);
  } else if (type != "scope") {
    newest_[type] = event_text(line);
  }
  seq_ = std::max(seq_, seq);
  if (type != "scope") last_[type] = std::move(document);
  return Event{text, type == "scope"};
}

void Feed::take_state(const Json& state) {
  const Json* before = last("state");
  const std::string now = text_in(state, "state"), was = before ? text_in(*before, "state") : "";
  // A paused campaign goes on through CHECK.
  if (now != "CHECK" || was == "CHECK" || was == "PAUSE") return;
  forget([](const Kept& kept) { return kept.type != "alarm"; });
  forgot_ = seq_;
  for (const char* type : {"estimate", "cycle", "wave", "run_start"}) {
    last_.erase(type);
    newest_.erase(type);
  }
}

// As protocol::StandingAlarms does.
void Feed::take_alarm(const Json& alarm) {
  const std::string code = text_in(alarm, "code");
  if (code == protocol::kAcknowledged)
    forget([](const Kept& kept) { return kept.type == "alarm"; });
  if (code == protocol::kWarningsSetAside)
    forget([](const Kept& kept) { return kept.type == "alarm" && kept.severity == "warning"; });
}

void Feed::forget(const std::function<bool(const Kept&)>& which) {
  std::erase_if(history_, [&](const Kept& kept) {
    if (!which(kept)) return false;
    bytes_ -= kept.text->size();
    return true;
  });
}

void Feed::keep(const Json& document, const std::string& type, std::uint64_t seq, Text text) {
  if (type == "estimate") slim_last_estimate();
  if (type == "alarm") {
    // A browser that comes back has to hear that alarms have ended.
    const std::string code = text_in(document, "code");
    const bool ends = code == protocol::kAcknowledged || code == protocol::kWarningsSetAside;
    if (text_in(document, "severity") == "info" && !ends) return;
    const auto count = std::ranges::count(history_, "alarm", &Kept::type);
    if (static_cast<std::size_t>(count) >= kMaxAlarms) return;  // the first ones name the cause
  }
  bytes_ += text->size();
  history_.push_back({seq, type, text_in(document, "severity"), std::move(text)});
  trim();
}

// The page draws the values and intervals of earlier estimates, and no matrix.
void Feed::slim_last_estimate() {
  const auto found = std::find_if(history_.rbegin(), history_.rend(),
                                  [](const Kept& kept) { return kept.type == "estimate"; });
  const Json* newest = last("estimate");
  if (found == history_.rend() || newest == nullptr) return;
  Json slim = *newest;
  for (const char* key : {"covariance", "covariance_order", "correlation", "warnings"})
    slim.erase(key);
  bytes_ -= found->text->size();
  found->text = event_text(slim.dump(-1, ' ', false, Json::error_handler_t::replace), found->seq);
  bytes_ += found->text->size();
}

void Feed::trim() {
  for (auto it = history_.begin(); bytes_ > max_bytes_ && it != history_.end();) {
    if (it->type != "cycle" && it->type != "estimate") {
      ++it;
      continue;
    }
    bytes_ -= it->text->size();
    forgot_ = std::max(forgot_, it->seq);
    it = history_.erase(it);
  }
}

std::vector<Event> Feed::opening(std::optional<std::uint64_t> last_id) const {
  std::vector<Event> events = {greeting()};
  const bool continues = last_id && *last_id >= forgot_ && *last_id <= seq_;
  const std::uint64_t seen = continues ? *last_id : 0;
  if (!continues) events.push_back({event_text("{}", 0, "reset")});
  // The state comes before the alarms: a state may tell a browser to forget some.
  for (const char* type : {"version", "rig", "state"}) {
    if (const auto found = newest_.find(type); found != newest_.end())
      events.push_back({found->second});
  }
  for (const Kept& kept : history_) {
    if (kept.seq > seen) events.push_back({kept.text});
  }
  for (const auto& [type, text] : newest_) {
    if (type != "version" && type != "rig" && type != "state") events.push_back({text});
  }
  events.push_back({event_text("{}", seq_, "ready")});
  return events;
}

}  // namespace shaker::gateway
