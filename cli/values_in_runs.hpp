// Estimates of parameters that are not the same in all runs (estimator/model/run_models.hpp).
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "cli/estimation_input.hpp"
#include "estimator/estimate.hpp"
#include "estimator/model/run_models.hpp"

namespace shaker::cli {

// Gives each run of the input its own model. An Error names the run and what its file lacks.
Result<estimator::RunModels> give_own_models(EstimationInput& input);

// A parameter that differs from run to run, as it is in one of them.
struct ValueInRun {
  std::string run, name, unit;
  double value = 0.0, standard_error = 0.0, lower = 0.0, upper = 0.0;
};

// Of all runs. `models` without runs gives none.
std::vector<ValueInRun> values_in_runs(const estimator::RunModels& models,
                                       const EstimationInput& input,
                                       const estimator::Estimate& estimate);

nlohmann::ordered_json in_runs_json(const std::vector<ValueInRun>& values);
std::string in_runs_table(const std::vector<ValueInRun>& values);  // empty where there are none

}  // namespace shaker::cli
