#include "estimator/diagnosis/fit/internal/model_of_run.hpp"

#include <stdexcept>

#include "estimator/model/run_models.hpp"

namespace shaker::estimator::diagnosis {

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

}  // namespace shaker::estimator::diagnosis
