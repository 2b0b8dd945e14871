// An estimate with names, units, intervals and warnings.
#include "estimator/fit/description.hpp"
#include "estimator/fit/determination.hpp"
#include "estimator/fit/internal/estimation_impl.hpp"

namespace shaker::estimator {

Estimate describe(const Model& model, const Fit& fit) {
  Estimate e;
  e.model = model.name();
  e.noise_standard_deviation = fit.noise;
  e.sum_of_squares = fit.sum_of_squares;
  e.condition = fit.condition;
  e.observations = fit.observations;
  e.degrees_of_freedom = fit.degrees_of_freedom;
  e.iterations = fit.iterations;
  e.converged = fit.status == FitStatus::converged || fit.status == FitStatus::undetermined;
  e.covariance = fit.covariance;
  std::vector<std::string> on_bound;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
    ParameterEstimate entry{
        p.name, p.effect, p.unit,  fit.theta[k],         fit.standard_error[k],
        0.0,    0.0,      p.fixed, fit.at_bound[k] != 0, fit.determined[k] != 0};
    const double half = fit.quantile * fit.standard_error[k];
    entry.lower = fit.theta[k] - half;
    entry.upper = fit.theta[k] + half;
    if (p.fixed) {
      entry.lower = entry.upper = fit.theta[k];
    } else {
      e.covariance_order.push_back(p.name);
      if (entry.at_bound) on_bound.push_back(p.name);
    }
    e.parameters.push_back(std::move(entry));
  }
  if (!fit.trouble.empty()) e.warnings.push_back(fit.trouble);
  for (std::string& sentence : determination_warnings(model, fit))
    e.warnings.push_back(std::move(sentence));
  for (std::string& sentence :
       closing_warnings(on_bound, fit.observations, e.covariance_order.size()))
    e.warnings.push_back(std::move(sentence));
  e.usable = fit.status == FitStatus::converged && on_bound.empty() && fit.degrees_of_freedom > 0;
  return e;
}

Estimate Estimator::describe() const {
  Estimate e = estimator::describe(impl_->data.model, impl_->fit);
  e.runs = static_cast<int>(impl_->data.runs.size());
  for (const RunState& run : impl_->data.runs)
    e.cycles += static_cast<long>(run.data.cycles + 0.5);
  const std::vector<std::string> branch = impl_->branch_warnings();
  e.warnings.insert(e.warnings.end(), branch.begin(), branch.end());
  e.usable = e.usable && branch.empty();
  e.gap = impl_->model_gap();
  for (std::string& sentence : impl_->gap_warnings(e.gap)) {
    e.warnings.push_back(std::move(sentence));
    e.intervals_hold = false;
  }
  return e;
}

}  // namespace shaker::estimator
