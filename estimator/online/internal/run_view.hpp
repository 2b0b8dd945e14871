// What a joint estimate says of one run, where parameters differ from run to run: the parameters of
// the model file, each with its value in that run. Pure.
#pragma once

#include <vector>

#include "estimator/fit/estimate.hpp"
#include "estimator/model/run_models.hpp"

namespace shaker::estimator::online {

// Where the parameters of `model`, the model of the file, stand among the joint ones. `run`: index
// in `models`. One entry for each parameter of `model`.
std::vector<RunParameter> places_in(const RunModels& models, const Model& model, std::size_t run);

// The values in that run, in the order of `places`. `joint`: all joint parameters.
std::vector<double> values_in(const std::vector<RunParameter>& places,
                              const std::vector<double>& joint);

// The estimate of the parameters in that run, under their names in the model file, with their
// covariance. What it says of the fit as a whole stays. A warning names the parameters that have
// other values in other runs.
Estimate seen_in(const std::vector<RunParameter>& places, const Estimate& joint,
                 const std::vector<RunParameter>& varying, const std::string& run);

}  // namespace shaker::estimator::online
