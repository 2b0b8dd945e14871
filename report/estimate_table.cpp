#include "report/estimate_table.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "report/text_table.hpp"

namespace shaker::report {
namespace {

std::string note(const protocol::ParameterEntry& parameter) {
  if (parameter.fixed) return "fixed";
  if (!parameter.determined) return "not determined";
  return parameter.at_bound ? "at its bound" : "";
}

std::string or_dash(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-";
}

// "bias taken off: at most 0.11 standard errors"; empty when no bias was removed.
std::string bias_line(const protocol::EstimateDocument& d) {
  double largest = 0.0;
  for (const protocol::ParameterEntry& p : d.parameters) {
    if (p.bias && p.standard_error > 0.0)
      largest = std::max(largest, std::fabs(*p.bias) / p.standard_error);
  }
  if (largest == 0.0) return {};
  return fmt::format("bias taken off: at most {:.2g} standard errors\n", largest);
}

std::string figures(const protocol::EstimateDocument& d) {
  std::string text = fmt::format(
      "noise {}   condition {}   {} observations, {} degrees of freedom   {} cycle{} of {} "
      "run{}   {} iteration{}\n",
      or_dash(d.noise_standard_deviation), or_dash(d.condition), d.observations,
      d.degrees_of_freedom, d.cycles_used, d.cycles_used == 1 ? "" : "s", d.runs_used,
      d.runs_used == 1 ? "" : "s", d.iterations, d.iterations == 1 ? "" : "s");
  if (d.gap && d.noise_floor)
    text += fmt::format("gap to the mean cycles {:.3g}   noise explains {:.2g}\n", *d.gap,
                        *d.noise_floor);
  text += bias_line(d);
  return text + estimate_verdict(d) + "\n";
}

}  // namespace

std::string estimate_table(const protocol::EstimateDocument& d) {
  std::vector<std::vector<std::string>> rows = {
      {"parameter", "value ± std. error", "95 % interval", "unit", "effect", "note"}};
  for (const protocol::ParameterEntry& p : d.parameters) {
    const double error = p.fixed || !p.determined ? std::nan("") : p.standard_error;
    const bool interval = std::isfinite(error) && std::isfinite(p.lower) && std::isfinite(p.upper);
    rows.push_back(
        {p.name, with_error(p.value, error),
         interval ? fmt::format("{} .. {}", rounded_to(p.lower, error), rounded_to(p.upper, error))
                  : "-",
         p.unit, p.effect, note(p)});
  }
  std::string text = fmt::format("model {}\n\n", d.model) +
                     text_table(rows, {false, true, true, false, false, false}) + "\n" + figures(d);
  for (const std::string& warning : d.warnings)
    text += "warning: " + warning + "\n";
  return text;
}

std::string estimate_verdict(const protocol::EstimateDocument& d) {
  if (!d.usable) return d.converged ? "NOT usable" : "NOT usable: not converged";
  if (d.intervals_hold) return "usable";
  return "the values stand, the INTERVALS DO NOT: they count noise, and not what the model lacks";
}

std::string estimate_line(const protocol::EstimateDocument& d) {
  std::string text;
  for (const protocol::ParameterEntry& p : d.parameters) {
    if (p.fixed) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", p.name,
                        p.determined ? with_error(p.value, p.standard_error) : "not determined");
  }
  if (!d.usable) return text + " (not usable)";
  return d.intervals_hold ? text : text + " (the intervals do not hold)";
}

}  // namespace shaker::report
