// The model of one run: parameters that go with a condition of the runs ("over", or "input" of an
// effect) have the run's own factor. All models have the same parameters.
#pragma once

#include <memory>

#include "config/model.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

// Values of their own for each run or group ("per"), and a condition that the campaign does not
// state, are left out: such a parameter is the same in all runs. Throws std::invalid_argument where
// a condition does not serve.
std::shared_ptr<const Model> model_of_run(const config::ModelSpec& spec, const RunDatum& datum);

// The parameters that a fit of these runs moves: not those that are fixed, nor values of runs or
// groups that were all left out.
std::vector<int> free_parameters(const Model& model, const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
