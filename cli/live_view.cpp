#include "cli/live_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <fmt/format.h>

#include "cli/documents_in.hpp"
#include "cli/terminal.hpp"
#include "cli/utc_text.hpp"
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
    // Lengths are in mm on the whole screen.
    const bool length = text_of(channel, "unit") == "m";
    const auto value = number_of(channel, "value");
    const std::string name = text_of(channel, "name");
    rows.push_back({printable(name.empty() ? text_of(channel, "channel") : name),
                    printable(text_of(channel, "quality")),
                    value ? fmt::format("{:.5g}", length ? 1e3 * *value : *value) : "-",
                    length ? "mm" : printable(text_of(channel, "unit")),
                    cell(channel, "rate_hz", "{:.0f}"),
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

// The part of lower .. upper that from .. to covers: "[...====....]".
std::string range_bar(double from, double to, double lower, double upper) {
  constexpr double kWidth = 20.0;
  const auto place = [&](double value) {
    return std::clamp((value - lower) / (upper - lower), 0.0, 1.0) * kWidth;
  };
  std::string bar(static_cast<std::size_t>(kWidth), '.');
  const auto first = static_cast<std::size_t>(std::min(kWidth - 1.0, std::floor(place(from))));
  const auto last = static_cast<std::size_t>(std::max(place(from) + 1.0, std::ceil(place(to))));
  for (std::size_t i = first; i < std::min(last, bar.size()); ++i)
    bar[i] = '=';
  return "[" + bar + "]";
}

// The estimated parameter whose relative standard error is largest. Empty without one.
std::string least_known(const protocol::EstimateDocument& estimate) {
  const protocol::ParameterEntry* worst = nullptr;
  const auto doubt = [](const protocol::ParameterEntry& p) {
    const double part = std::abs(p.standard_error / p.value);
    return p.determined && std::isfinite(part) ? part : std::numeric_limits<double>::infinity();
  };
  for (const protocol::ParameterEntry& p : estimate.parameters) {
    if (!p.fixed && (worst == nullptr || doubt(p) > doubt(*worst))) worst = &p;
  }
  if (worst == nullptr) return {};
  if (!worst->determined)
    return fmt::format("known least: {} is not determined by these cycles", worst->name);
  return fmt::format("known least: {} = {} {} ({:.2g} %)", worst->name,
                     report::with_error(worst->value, worst->standard_error), worst->unit,
                     100.0 * doubt(*worst));
}

// The known least parameter, and where the estimate may not be used as it is, that.
void add_least_known(std::vector<LiveView::Line>& out, const protocol::EstimateDocument& estimate) {
  if (const std::string worst = least_known(estimate); !worst.empty()) out.push_back({worst});
  if (!estimate.usable || !estimate.intervals_hold)
    out.push_back({report::estimate_verdict(estimate), LiveView::Style::warning});
}

// The lines, wrapped where there is room. None of the first `firm` is pushed out by that: the lines
// behind them give way.
std::vector<LiveView::Line> laid_out(const std::vector<LiveView::Line>& lines, std::size_t firm,
                                     int width, std::size_t height) {
  std::vector<LiveView::Line> out;
  for (std::size_t i = 0; i < lines.size() && out.size() < height; ++i) {
    const std::size_t to_come = i + 1 < firm ? firm - i - 1 : 0;
    const std::size_t room = height - out.size();
    const std::vector<std::string> parts = wrapped(lines[i].text, width);
    const std::size_t most = std::max<std::size_t>(1, room > to_come ? room - to_come : 0);
    for (std::size_t part = 0; part < std::min(parts.size(), most); ++part)
      out.push_back({parts[part], lines[i].style});
  }
  return out;
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
  if (const std::string utc = text_of(document, "t_utc"); !utc.empty()) now_utc_ = utc;
  if (type == "state") take_state(document);
  if (type == "version") last_.erase("run_start");  // a new connection: cycles may have been missed
  if (type == "run_start") accepted_ = rejected_ = 0;
  if (type == "cycle") ++(flag_of(document, "accepted") ? accepted_ : rejected_);
  if (type == "run_start" || type == "run_stop" || type == "missed" || type == "diagnosis_result") {
    add_event(document);
  }
  last_[type] = document;
  if (type == "alarm" && text_of(document, "severity") == "info") add_event(document);
  return alarms_.take(document);
}

void LiveView::add_event(const Json& document) {
  events_.push_back(clock_of(text_of(document, "t_utc")) + "  " + narrate(document));
  if (events_.size() > kEvents) events_.pop_front();
}

void LiveView::take_state(const Json& document) {
  const Json* before = last("state");
  const std::string now = text_of(document, "state"), was = before ? text_of(*before, "state") : "";
  const bool begins = now == "CHECK" && was != "CHECK" && was != "PAUSE";
  if (!begins) return;
  for (const char* type : {"estimate", "cycle", "run_start"})
    last_.erase(type);
  events_.clear();
}

void LiveView::add_alarms(std::vector<Line>& out) const {
  const auto standing = alarms_.by_severity();
  for (std::size_t i = 0; i < std::min(standing.size(), kAlarms); ++i) {
    const protocol::StandingAlarm& alarm = standing[i];
    const bool today = alarm.since_utc.substr(0, 10) == now_utc_.substr(0, 10);
    out.push_back(
        {fmt::format("{} since {}{}: {}", alarm.error ? "ALARM" : "warning",
                     today ? clock_of(alarm.since_utc) + " UTC" : readable_utc(alarm.since_utc),
                     alarm.times > 1 ? fmt::format(", {} times", alarm.times) : "",
                     printable(alarm.text)),
         alarm.error ? Style::alarm : Style::warning});
  }
  if (standing.size() > kAlarms)
    out.push_back({fmt::format("and {} more: `shakerctl status` shows them, `shakerctl ack` ends "
                               "them",
                               standing.size() - kAlarms),
                   Style::warning});
}

// What the last cycle did within the limits of the rig, and what is left.
void LiveView::add_limits(std::vector<Line>& out) const {
  const Json *version = last("version"), *cycle = last("cycle");
  if (version == nullptr || cycle == nullptr || !version->contains("limits")) return;
  const Json& limits = (*version)["limits"];
  const auto low = number_of(*cycle, "stroke_min_m"), high = number_of(*cycle, "stroke_max_m");
  const auto lower = number_of(limits, "stroke_min_m"), upper = number_of(limits, "stroke_max_m");
  if (low && high && lower && upper && *lower < *upper)
    out.push_back(
        {fmt::format("stroke {} {:.1f} to {:.1f} of {:g} to {:g} mm, {:.1f} mm left",
                     range_bar(*low, *high, *lower, *upper), 1e3 * *low, 1e3 * *high, 1e3 * *lower,
                     1e3 * *upper, 1e3 * std::min(*low - *lower, *upper - *high))});
  const auto add = [&](const char* name, const char* value, const char* limit, const char* unit) {
    const auto is = number_of(*cycle, value), most = number_of(limits, limit);
    if (!is || !most || *most <= 0.0) return;
    out.push_back({fmt::format("{:<6} {} {:.3g} of {:g} {}, {:.0f} % left", name,
                               range_bar(0.0, *is, 0.0, *most), *is, *most, unit,
                               100.0 * (1.0 - *is / *most))});
  };
  add("speed", "stroke_rate_m_s", "stroke_rate_max_m_s", "m/s");
  add("table", "amplitude", "excitation_max_m_s2", "m/s^2");
}

// Who connects in the middle of a run knows from the state which one it is, and not its cycles.
void LiveView::add_run(std::vector<Line>& out, const Json& state) const {
  const Json* begun = last("run_start");
  const Json* where = state.contains("run_count") ? &state : begun;
  if (where == nullptr) return;
  std::string line = fmt::format("run {} of {}, {}", count_of(*where, "run_index") + 1,
                                 count_of(*where, "run_count"), printable(text_of(*where, "run")));
  if (begun != nullptr && count_of(*begun, "run_index") == count_of(*where, "run_index"))
    line += fmt::format(": {} of {} cycles accepted, {} left out", accepted_,
                        count_of(*begun, "cycles_wanted"), rejected_);
  out.push_back({line});
}

// Setpoint and measured values, and the progress of the campaign. Nothing when the rig is at
// rest.
void LiveView::add_motion(std::vector<Line>& out, const Json& state) const {
  if (at_rest(text_of(state, "state"))) return;
  const auto frequency = number_of(state, "frequency_hz");
  if (frequency && *frequency > 0.0) {
    std::string line =
        fmt::format("setpoint {:.4g} Hz, {} m/s^2", *frequency, cell(state, "amplitude", "{:.4g}"));
    if (const Json* cycle = last("cycle"))
      line += fmt::format("   measured {} Hz, {} m/s^2", cell(*cycle, "frequency_hz", "{:.5g}"),
                          cell(*cycle, "amplitude", "{:.4g}"));
    out.push_back({line});
  }
  add_run(out, state);
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
  if (!rests) add_limits(out);
  if (const Json* cycle = last("cycle"); cycle && !rests) out.push_back({narrate(*cycle)});
  const Json* estimate = last("estimate");
  if (estimate) add_least_known(out, estimate_from(*estimate));
  const std::size_t first = out.size();
  out.emplace_back();
  std::vector<std::string> texts;
  if (const Json* health = last("health")) add_channels(texts, *health);
  if (estimate) {
    add_text(texts, report::estimate_table(estimate_from(*estimate)));
    texts.emplace_back();
  }
  add(texts);
  for (const std::string& event : events_)
    out.push_back({event});
  return laid_out(out, first, width, static_cast<std::size_t>(std::max(height, 0)));
}

}  // namespace shaker::cli
