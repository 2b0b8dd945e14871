#include "estimator/diagnosis/fit/internal/model_of_run.hpp"

#include <algorithm>
#include <stdexcept>

#include "estimator/model/run_models.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// A value of a run or a group whose runs were all left out acts in none.
bool acts_in_a_run(const ModelParameter& p, const std::vector<RunDatum>& data) {
  const std::string& per = p.variation.per;
  if (per.empty() || p.variation.values.empty()) return true;
  return std::ranges::any_of(data, [&](const RunDatum& datum) {
    const std::string& label = per == "run" ? datum.condition.run : datum.condition.group;
    return datum.role == Role::fit && p.name.ends_with("[" + label + "]");
  });
}

}  // namespace

std::shared_ptr<const Model> model_of_run(const config::ModelSpec& spec, const RunDatum& datum) {
  if (!varies_by_run(spec)) return std::make_shared<const Model>(spec);
  config::ModelSpec own = spec;
  for (config::EffectSpec& line : own.effects) {
    for (auto& [symbol, parameter] : line.parameters) {
      const config::RunVariation& v = parameter.variation;
      if (!v.over.empty() && !datum.condition.values.contains(v.condition()))
        parameter.variation = {};
    }
  }
  if (!varies_by_run(own)) return std::make_shared<const Model>(own);
  const auto models = run_models(own, {datum.condition});
  if (!models) throw std::invalid_argument(models.error().what);
  return models->of_run.front();
}

std::vector<int> free_parameters(const Model& model, const std::vector<RunDatum>& data) {
  std::vector<int> free;
  for (int k = 0; k < model.parameter_count(); ++k) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(k)];
    if (!p.fixed && acts_in_a_run(p, data)) free.push_back(k);
  }
  return free;
}

}  // namespace shaker::estimator::diagnosis
