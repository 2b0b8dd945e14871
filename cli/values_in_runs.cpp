#include "cli/values_in_runs.hpp"

#include <cmath>

#include <fmt/format.h>

#include "report/text_table.hpp"

namespace shaker::cli {

using estimator::ValueInRun;

nlohmann::ordered_json in_runs_json(const std::vector<ValueInRun>& values) {
  auto list = nlohmann::ordered_json::array();
  for (const ValueInRun& v : values) {
    nlohmann::ordered_json item = {
        {"run", v.run}, {"name", v.name}, {"unit", v.unit}, {"value", v.value}};
    if (std::isfinite(v.standard_error)) {
      item["standard_error"] = v.standard_error;
      item["interval"] = {v.lower, v.upper};
    }
    list.push_back(std::move(item));
  }
  return list;
}

std::string in_runs_table(const std::vector<ValueInRun>& values) {
  if (values.empty()) return {};
  std::vector<std::vector<std::string>> rows = {{"run", "parameter", "value", "95 %", "unit"}};
  for (const ValueInRun& v : values) {
    const bool known = std::isfinite(v.standard_error);
    rows.push_back(
        {v.run, v.name,
         known ? report::with_error(v.value, v.standard_error) : fmt::format("{:.5g}", v.value),
         known ? fmt::format("{:.5g} to {:.5g}", v.lower, v.upper) : "not determined", v.unit});
  }
  return "\nIn each run:\n\n" + report::text_table(rows, {false, false, true, true, false}) + "\n";
}

}  // namespace shaker::cli
