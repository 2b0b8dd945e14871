#include "cli/values_in_runs.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "report/text_table.hpp"

namespace shaker::cli {

Result<estimator::RunModels> give_own_models(EstimationInput& input) {
  std::vector<config::RunCondition> conditions;
  for (const estimator::RunData& run : input.runs)
    conditions.push_back(run.condition);
  auto models = estimator::run_models(input.model, conditions);
  if (!models) return models;
  for (std::size_t r = 0; r < input.runs.size(); ++r)
    input.runs[r].model = models->of_run[r];
  return models;
}

std::vector<ValueInRun> values_in_runs(const estimator::RunModels& models,
                                       const EstimationInput& input,
                                       const estimator::Estimate& estimate) {
  std::vector<ValueInRun> all;
  for (std::size_t r = 0; r < models.varying.size(); ++r) {
    for (const estimator::RunParameter& own : models.varying[r]) {
      const auto& p = estimate.parameters[static_cast<std::size_t>(own.index)];
      all.push_back({input.runs[r].condition.run, own.name, p.unit, own.factor * p.value,
                     own.factor * p.standard_error, own.factor * p.lower, own.factor * p.upper});
    }
  }
  return all;
}

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
