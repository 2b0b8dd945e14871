#include "estimator/online/internal/run_view.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace shaker::estimator::online {

std::vector<RunParameter> places_in(const RunModels& models, const Model& model, std::size_t run) {
  const auto& own = models.varying[run];
  const auto& joint = models.joint().parameters();
  std::vector<RunParameter> places;
  for (const ModelParameter& p : model.parameters()) {
    const auto found = std::ranges::find(own, p.name, &RunParameter::name);
    if (found != own.end()) {
      places.push_back(*found);
      continue;
    }
    const auto at = std::ranges::find(joint, p.name, &ModelParameter::name) - joint.begin();
    places.push_back({p.name, static_cast<int>(at), 1.0});
  }
  return places;
}

std::vector<double> values_in(const std::vector<RunParameter>& places,
                              const std::vector<double>& joint) {
  std::vector<double> values;
  for (const RunParameter& place : places)
    values.push_back(place.factor * joint[static_cast<std::size_t>(place.index)]);
  return values;
}

Estimate seen_in(const std::vector<RunParameter>& places, const Estimate& joint,
                 const std::vector<RunParameter>& varying, const std::string& run) {
  Estimate seen = joint;
  seen.parameters.clear();
  seen.covariance.clear();
  seen.covariance_order.clear();
  const auto& order = joint.covariance_order;
  std::vector<std::size_t> rows;  // of the joint covariance
  std::vector<double> factors;
  for (const RunParameter& place : places) {
    ParameterEstimate p = joint.parameters[static_cast<std::size_t>(place.index)];
    const auto row = std::ranges::find(order, p.name);
    p.fixed = p.fixed || place.factor == 0.0;  // the effect is off in this run
    if (row != order.end() && !p.fixed) {
      rows.push_back(static_cast<std::size_t>(row - order.begin()));
      factors.push_back(place.factor);
      seen.covariance_order.push_back(place.name);
    }
    p.name = place.name;
    for (double* value : {&p.value, &p.standard_error, &p.lower, &p.upper, &p.bias})
      *value *= place.factor;
    seen.parameters.push_back(std::move(p));
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows.size(); ++k)
      seen.covariance.push_back(factors[i] * factors[k] *
                                joint.covariance[rows[i] * order.size() + rows[k]]);
  }
  std::vector<std::string> names;
  for (const RunParameter& own : varying)
    names.push_back(own.name);
  seen.warnings.push_back(fmt::format("{} {} as in run {}: the model lets {} differ between runs",
                                      fmt::join(names, ", "), names.size() == 1 ? "is" : "are", run,
                                      names.size() == 1 ? "it" : "them"));
  return seen;
}

}  // namespace shaker::estimator::online
