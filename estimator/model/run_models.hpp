// Models of the single runs of an estimation whose parameters are not all the same in all runs.
//
// A parameter with "per": "run" or "group" becomes one parameter for each run or group, named
// theta2[r01]: those that the variation names, then those that runs add. One with "over":
// "gas_temperature" stays one parameter: its value at the reference. In a run it is multiplied by
// the run's condition over the reference. All models have the same parameters; each depends on
// those of its own run. RunData::model carries them to the estimator.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/run_condition.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator {

// The value of a parameter in one run is `factor` times the joint parameter `index`.
struct RunParameter {
  std::string name;  // in the model file
  int index = 0;
  double factor = 1.0;
};

struct RunModels {
  std::vector<std::shared_ptr<const Model>> of_run;
  // Of each run: the parameters that differ from run to run.
  std::vector<std::vector<RunParameter>> varying;

  const Model& joint() const { return *of_run.front(); }
};

// True if a parameter differs from run to run.
bool varies_by_run(const config::ModelSpec& spec);

// True if the values of a parameter with "per" are known (config::RunVariation::values).
bool has_run_values(const config::ModelSpec& spec);

// The model of a run that has the first value of each such parameter. What goes with a condition is
// at its reference. Throws as Model does.
Model model_of_first_values(const config::ModelSpec& spec);

// A sentence that names the parameters which differ from run to run in the file and which `what`
// (as "diagnose") takes as the same in all runs; empty where there are none.
std::string taken_as_one(const config::ModelSpec& spec, const std::string& what);

// A sentence on the first run that lacks a group or a condition which the model needs, or has one
// that is not above 0; empty: there is none. Builds no model.
std::string lacking_condition(const config::ModelSpec& spec,
                              const std::vector<config::RunCondition>& runs);

// The models of the runs, at least one. An Error names the run that lacks a group or a condition,
// or has one that is not above 0. Throws as Model does.
Result<RunModels> run_models(const config::ModelSpec& spec,
                             const std::vector<config::RunCondition>& runs);

}  // namespace shaker::estimator
