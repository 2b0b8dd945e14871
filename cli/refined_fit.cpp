#include "cli/refined_fit.hpp"

#include <cmath>

#include <fmt/format.h>

namespace shaker::cli {

RefinedFit::RefinedFit(const estimator::Model& model, const std::vector<estimator::RunData>& runs,
                       const estimator::EstimationOptions& how, double accuracy) {
  if (accuracy == 0.0) {
    usual_.emplace(model, runs, how);
    return;
  }
  estimator::AccurateOptions options;
  const estimator::GridOptions first = options.estimation.grid;
  options.estimation = how;
  options.estimation.grid = first;
  options.accuracy = accuracy;
  refined_.emplace(model, runs, options);
}

const estimator::Fit& RefinedFit::fit(const std::vector<double>& start) {
  return refined_ ? refined_->fit(start) : usual_->fit(start);
}

estimator::Estimate RefinedFit::describe() {
  estimator::Estimate estimate = estimator().describe();
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

nlohmann::ordered_json RefinedFit::grid() const {
  nlohmann::ordered_json json = {{"points", refined_->points()}, {"reached", refined_->reached()}};
  if (std::isfinite(refined_->error())) json["error"] = refined_->error();
  return json;
}

}  // namespace shaker::cli
