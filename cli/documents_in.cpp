#include "cli/documents_in.hpp"

#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "report/estimate_table.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;

double number_or_nan(const Json& document, const char* key) {
  return number_of(document, key).value_or(std::numeric_limits<double>::quiet_NaN());
}

const Json& list_of(const Json& document, const char* key) {
  static const Json kNone = Json::array();
  const auto at = document.find(key);
  return at != document.end() && at->is_array() ? *at : kNone;
}

protocol::ParameterEntry parameter_from(const Json& json) {
  protocol::ParameterEntry entry;
  entry.name = printable(text_of(json, "name"));
  entry.effect = printable(text_of(json, "effect"));
  entry.unit = printable(text_of(json, "unit"));
  entry.value = number_or_nan(json, "value");
  entry.standard_error = number_or_nan(json, "standard_error");
  entry.lower = entry.upper = std::numeric_limits<double>::quiet_NaN();
  const Json& interval = list_of(json, "interval");
  if (interval.size() == 2 && interval[0].is_number() && interval[1].is_number()) {
    entry.lower = interval[0].get<double>();
    entry.upper = interval[1].get<double>();
  }
  if (const double bias = number_or_nan(json, "bias"); std::isfinite(bias)) entry.bias = bias;
  entry.fixed = flag_of(json, "fixed");
  entry.at_bound = flag_of(json, "at_bound");
  entry.determined = flag_of(json, "determined");
  return entry;
}

std::string narrate_state(const Json& d) {
  std::string line = fmt::format("state {}", text_of(d, "state"));
  if (flag_of(d, "unprotected")) line += " (UNPROTECTED: no detector ends the motion)";
  if (const auto reason = text_of(d, "reason"); !reason.empty()) line += ": " + reason;
  return line;
}

std::string narrate_cycle(const Json& d) {
  const bool accepted = flag_of(d, "accepted");
  return fmt::format("cycle {} of {} {}: {:.5g} Hz, {:.4g} m/s^2, stroke {:.1f} to {:.1f} mm",
                     count_of(d, "cycle"), text_of(d, "run"),
                     accepted ? "accepted" : "left out (" + text_of(d, "why") + ")",
                     number_or_nan(d, "frequency_hz"), number_or_nan(d, "amplitude"),
                     1e3 * number_or_nan(d, "stroke_min_m"),
                     1e3 * number_or_nan(d, "stroke_max_m"));
}

std::string narrate_alarm(const Json& d) {
  std::string line = fmt::format("{}: {}", text_of(d, "severity"), text_of(d, "text"));
  const auto action = text_of(d, "action");
  if (!action.empty() && action != "none") line += fmt::format(" (action: {})", action);
  return line;
}

std::string narrate_line(const Json& d) {
  const std::string type = text_of(d, "type");
  if (type == "state") return narrate_state(d);
  if (type == "cycle") return narrate_cycle(d);
  if (type == "alarm") return narrate_alarm(d);
  if (type == "estimate") {
    const auto estimate = estimate_from(d);
    return fmt::format("estimate from {} cycle{}: {}", estimate.cycles_used,
                       estimate.cycles_used == 1 ? "" : "s", report::estimate_line(estimate));
  }
  if (type == "version") {
    return fmt::format("{} {} on rig {}", text_of(d, "program"), text_of(d, "version"),
                       text_of(d, "rig"));
  }
  if (type == "run_start") {
    return fmt::format("run {} of {}, {}: {:.4g} Hz, {:.4g} m/s^2, {} cycles",
                       count_of(d, "run_index") + 1, count_of(d, "run_count"), text_of(d, "run"),
                       number_or_nan(d, "frequency_hz"), number_or_nan(d, "amplitude"),
                       count_of(d, "cycles_wanted"));
  }
  if (type == "run_stop") {
    return fmt::format("run {}: {} ({} cycles accepted, {} left out){}{}", text_of(d, "run"),
                       text_of(d, "status"), count_of(d, "cycles_accepted"),
                       count_of(d, "cycles_rejected"), text_of(d, "reason").empty() ? "" : ": ",
                       text_of(d, "reason"));
  }
  if (type == "diagnosis_progress") {
    return fmt::format("diagnosis of {}: {}, {:.0f} %", text_of(d, "campaign"), text_of(d, "stage"),
                       100.0 * number_or_nan(d, "share"));
  }
  if (type == "diagnosis_result") {
    return fmt::format("diagnosis of {} {}: {}", text_of(d, "campaign"), text_of(d, "status"),
                       text_of(d, "reason"));
  }
  if (type == "missed") {
    return fmt::format("{} lines were missed: this program read too slowly", count_of(d, "count"));
  }
  return {};
}

}  // namespace

std::string printable(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < 0x20 || byte == 0x7f) text[i] = ' ';
    // U+0080 to U+009F are control characters too; they have two bytes.
    if (byte == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0) {
      text[i] = text[i + 1] = ' ';
    }
  }
  return text;
}

std::string text_of(const Json& document, const char* key) {
  if (!document.is_object()) return {};
  const auto at = document.find(key);
  return at != document.end() && at->is_string() ? at->get<std::string>() : std::string();
}

std::int64_t count_of(const Json& document, const char* key) {
  const auto at = document.find(key);
  return at != document.end() && at->is_number_integer() ? at->get<std::int64_t>() : 0;
}

std::optional<double> number_of(const Json& document, const char* key) {
  const auto at = document.find(key);
  if (at == document.end() || !at->is_number()) return std::nullopt;
  return at->get<double>();
}

bool flag_of(const Json& document, const char* key) {
  const auto at = document.find(key);
  return at != document.end() && at->is_boolean() && at->get<bool>();
}

protocol::EstimateDocument estimate_from(const Json& d) {
  protocol::EstimateDocument estimate;
  if (d.contains("campaign")) estimate.campaign = text_of(d, "campaign");
  if (d.contains("run")) estimate.run = text_of(d, "run");
  if (d.contains("cycle")) estimate.cycle = count_of(d, "cycle");
  estimate.model = printable(text_of(d, "model"));
  for (const Json& parameter : list_of(d, "parameters")) {
    if (parameter.is_object()) estimate.parameters.push_back(parameter_from(parameter));
  }
  estimate.noise_standard_deviation = number_or_nan(d, "noise_standard_deviation");
  estimate.sum_of_squares = number_or_nan(d, "sum_of_squares");
  estimate.condition = number_or_nan(d, "condition");
  estimate.observations = count_of(d, "observations");
  estimate.degrees_of_freedom = count_of(d, "degrees_of_freedom");
  estimate.cycles_used = count_of(d, "cycles_used");
  estimate.runs_used = static_cast<int>(count_of(d, "runs_used"));
  estimate.iterations = static_cast<int>(count_of(d, "iterations"));
  estimate.converged = flag_of(d, "converged");
  estimate.usable = flag_of(d, "usable");
  estimate.intervals_hold = !d.contains("intervals_hold") || flag_of(d, "intervals_hold");
  estimate.gap = number_of(d, "gap");
  estimate.noise_floor = number_of(d, "noise_floor");
  for (const Json& warning : list_of(d, "warnings")) {
    if (warning.is_string()) estimate.warnings.push_back(printable(warning.get<std::string>()));
  }
  return estimate;
}

std::string narrate(const Json& document) {
  if (!document.is_object()) return "a line that is not a document";
  return printable(narrate_line(document));
}

}  // namespace shaker::cli
