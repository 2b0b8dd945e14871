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
constexpr std::size_t kEvents = 6;

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

}  // namespace

void LiveView::take(const Json& document) {
  if (!document.is_object()) return;
  const std::string type = text_of(document, "type");
  if (type == "run_start") accepted_ = rejected_ = 0;
  if (type == "cycle") ++(flag_of(document, "accepted") ? accepted_ : rejected_);
  if (type == "run_start" || type == "run_stop" || type == "alarm" || type == "missed" ||
      type == "diagnosis_result") {
    events_.push_back(text_of(document, "t_utc").substr(0, 19) + "  " + narrate(document));
    if (events_.size() > kEvents) events_.pop_front();
  }
  last_[type] = document;
}

std::vector<std::string> LiveView::lines(int width, int height) const {
  std::vector<std::string> out;
  const auto find = [&](const char* type) -> const Json* {
    const auto at = last_.find(type);
    return at == last_.end() ? nullptr : &at->second;
  };
  if (const Json* version = find("version")) out.push_back(narrate(*version));
  if (const Json* state = find("state")) {
    out.push_back(narrate(*state));
    if (const auto progress = number_of(*state, "progress")) {
      const auto eta = number_of(*state, "eta_s");
      out.push_back(progress_bar(*progress, 30) + (eta ? "   ETA " + report::duration(*eta) : ""));
    }
  }
  if (const Json* cycle = find("cycle")) {
    out.push_back(
        fmt::format("{}   ({} accepted, {} left out)", narrate(*cycle), accepted_, rejected_));
  }
  out.emplace_back();
  if (const Json* health = find("health")) add_channels(out, *health);
  if (const Json* estimate = find("estimate")) {
    add_text(out, report::estimate_table(estimate_from(*estimate)));
    out.emplace_back();
  }
  out.insert(out.end(), events_.begin(), events_.end());
  if (static_cast<int>(out.size()) > height) out.resize(static_cast<std::size_t>(height));
  for (std::string& line : out)
    line = clipped(line, width);
  return out;
}

}  // namespace shaker::cli
