#include "cli/live_view.hpp"

#include <sstream>

#include <fmt/format.h>

#include "cli/documents_in.hpp"
#include "cli/terminal.hpp"
#include "report/estimate_table.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;
constexpr std::size_t kEvents = 6;  // past events that are shown
constexpr std::size_t kAlarms = 5;  // newest alarms: so many can be read at a glance

void add_text(std::vector<std::string>& lines, const std::string& text) {
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    lines.push_back(line);
}

std::string cell(const Json& object, const char* key, const char* format) {
  const auto value = number_of(object, key);
  return value ? fmt::format(fmt::runtime(format), *value) : "-";
}

void add_channels(std::vector<std::string>& lines, const Json& health) {
  const auto channels = health.find("channels");
  if (channels == health.end() || !channels->is_array() || channels->empty()) return;
  std::vector<std::vector<std::string>> rows = {
      {"channel", "quality", "value", "unit", "rate/Hz", "age/ms"}};
  for (const Json& channel : *channels) {
    if (!channel.is_object()) continue;
    const auto age = number_of(channel, "age_s");
    const std::string name = text_of(channel, "name");
    rows.push_back({printable(name.empty() ? text_of(channel, "channel") : name),
                    printable(text_of(channel, "quality")), cell(channel, "value", "{:.5g}"),
                    printable(text_of(channel, "unit")), cell(channel, "rate_hz", "{:.0f}"),
                    age ? fmt::format("{:.0f}", 1e3 * *age) : "-"});
  }
  add_text(lines, report::text_table(rows, {false, false, true, false, true, true}));
  lines.emplace_back();
}

// The time of day in an RFC 3339 time stamp.
std::string clock_of(const std::string& t_utc) {
  return t_utc.size() >= 19 ? t_utc.substr(11, 8) : t_utc;
}

bool at_rest(const std::string& state) {
  return state == "IDLE" || state == "FAULT";
}

}  // namespace

const Json* LiveView::last(const char* type) const {
  const auto at = last_.find(type);
  return at == last_.end() ? nullptr : &at->second;
}

bool LiveView::take(const Json& document) {
  if (!document.is_object()) return false;
  lost_.clear();
  const std::string type = text_of(document, "type");
  if (type == "state") take_state(document);
  if (type == "run_start") accepted_ = rejected_ = 0;
  if (type == "cycle") ++(flag_of(document, "accepted") ? accepted_ : rejected_);
  if (type == "run_start" || type == "run_stop" || type == "missed" || type == "diagnosis_result") {
    add_event(document);
  }
  last_[type] = document;
  return type == "alarm" && take_alarm(document);
}

void LiveView::add_event(const Json& document) {
  events_.push_back(clock_of(text_of(document, "t_utc")) + "  " + narrate(document));
  if (events_.size() > kEvents) events_.pop_front();
}

void LiveView::take_state(const Json& document) {
  const Json* before = last("state");
  const std::string now = text_of(document, "state"), was = before ? text_of(*before, "state") : "";
  const bool begins = now == "CHECK" && was != "CHECK" && was != "PAUSE";
  if (begins || (was == "FAULT" && now == "IDLE")) alarms_.clear();
  if (!begins) return;
  for (const char* type : {"estimate", "cycle", "run_start"})
    last_.erase(type);
  events_.clear();
}

bool LiveView::take_alarm(const Json& document) {
  const std::string severity = text_of(document, "severity");
  if (severity != "error" && severity != "warning") {
    add_event(document);
    return false;
  }
  const std::string code = text_of(document, "code"), text = printable(text_of(document, "text"));
  const bool error = severity == "error";
  for (Alarm& known : alarms_) {
    if (known.code != code || known.error != error) continue;
    known.text = text;
    ++known.times;
    return error;
  }
  alarms_.push_back({clock_of(text_of(document, "t_utc")), code, text, error});
  if (alarms_.size() > kAlarms) alarms_.pop_front();
  return error;
}

void LiveView::add_alarms(std::vector<Line>& out) const {
  for (const bool error : {true, false}) {
    for (const Alarm& alarm : alarms_) {
      if (alarm.error != error) continue;
      out.push_back(
          {fmt::format("{} since {} UTC{}: {}", error ? "ALARM" : "warning", alarm.since,
                       alarm.times > 1 ? fmt::format(", {} times", alarm.times) : "", alarm.text),
           error ? Style::alarm : Style::warning});
    }
  }
}

// Setpoint and measured values, and the progress of the campaign. Nothing when the rig is at
// rest.
void LiveView::add_motion(std::vector<Line>& out, const Json& state) const {
  if (at_rest(text_of(state, "state"))) return;
  if (const auto frequency = number_of(state, "frequency_hz")) {
    std::string line =
        fmt::format("setpoint {:.4g} Hz, {} m/s^2", *frequency, cell(state, "amplitude", "{:.4g}"));
    if (const Json* cycle = last("cycle"))
      line += fmt::format("   measured {} Hz, {} m/s^2", cell(*cycle, "frequency_hz", "{:.5g}"),
                          cell(*cycle, "amplitude", "{:.4g}"));
    out.push_back({line});
  }
  if (const Json* run = last("run_start")) {
    out.push_back({fmt::format("run {} of {}, {}: {} of {} cycles accepted, {} left out",
                               count_of(*run, "run_index") + 1, count_of(*run, "run_count"),
                               printable(text_of(*run, "run")), accepted_,
                               count_of(*run, "cycles_wanted"), rejected_)});
  }
  if (const auto progress = number_of(state, "progress")) {
    const auto eta = number_of(state, "eta_s");
    out.push_back({progress_bar(*progress, 30) + (eta ? "   ETA " + report::duration(*eta) : "")});
  }
}

std::vector<LiveView::Line> LiveView::lines(int width, int height) const {
  std::vector<Line> out;
  const auto add = [&out](const std::vector<std::string>& texts) {
    for (const std::string& text : texts)
      out.push_back({text});
  };
  if (!lost_.empty()) out.push_back({"NO CONNECTION: " + lost_, Style::alarm});
  if (const Json* version = last("version")) out.push_back({narrate(*version)});
  const Json* state = last("state");
  if (state)
    out.push_back(
        {narrate(*state), text_of(*state, "state") == "FAULT" ? Style::alarm : Style::plain});
  add_alarms(out);
  if (state) add_motion(out, *state);
  const bool rests = state && at_rest(text_of(*state, "state"));
  if (const Json* cycle = last("cycle"); cycle && !rests) out.push_back({narrate(*cycle)});
  out.emplace_back();
  std::vector<std::string> texts;
  if (const Json* health = last("health")) add_channels(texts, *health);
  if (const Json* estimate = last("estimate")) {
    add_text(texts, report::estimate_table(estimate_from(*estimate)));
    texts.emplace_back();
  }
  add(texts);
  for (const std::string& event : events_)
    out.push_back({event});
  if (static_cast<int>(out.size()) > height) out.resize(static_cast<std::size_t>(height));
  for (Line& line : out)
    line.text = clipped(line.text, width);
  return out;
}

}  // namespace shaker::cli
