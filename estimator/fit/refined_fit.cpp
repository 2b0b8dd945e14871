#include "estimator/fit/refined_fit.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/model/effects/turning.hpp"

namespace shaker::estimator {
namespace {

constexpr double kAccuracyOfFriction = 1e-4;  // of the parameters, relative

}  // namespace

double accuracy_for(const config::ModelSpec& model, const std::vector<RunData>& runs,
                    double asked) {
  const bool over_periods =
      std::any_of(runs.begin(), runs.end(), [](const RunData& run) { return run.periods > 1; });
  return asked > 0.0 || over_periods || !states_smoothing_width(model) ? asked
                                                                       : kAccuracyOfFriction;
}

RefinedFit::RefinedFit(const Model& model, const std::vector<RunData>& runs,
                       const EstimationOptions& how, double accuracy) {
  if (accuracy == 0.0) {
    usual_.emplace(model, runs, how);
    return;
  }
  AccurateOptions options;
  const GridOptions first = options.estimation.grid;
  options.estimation = how;
  options.estimation.grid = first;
  options.accuracy = accuracy;
  refined_.emplace(model, runs, options);
}

const Fit& RefinedFit::fit(const std::vector<double>& start) {
  return refined_ ? refined_->fit(start) : usual_->fit(start);
}

Estimate RefinedFit::describe() {
  Estimate estimate = estimator().describe();
  if (refined_ && estimate.converged && !refined_->reached())
    estimate.warnings.push_back(sentence() + ", which is more than was asked for");
  return estimate;
}

std::string RefinedFit::sentence() const {
  if (!std::isfinite(refined_->error()))
    return fmt::format("on {} points a period; what that is worth cannot be told",
                       refined_->points());
  return fmt::format("on {} points a period, which changes no parameter by more than {:.1e} of it",
                     refined_->points(), refined_->error());
}

}  // namespace shaker::estimator
