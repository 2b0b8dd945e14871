#include "report/estimate_document.hpp"

namespace shaker::report {

protocol::EstimateDocument to_document(const estimator::Estimate& estimate) {
  protocol::EstimateDocument document;
  document.model = estimate.model;
  document.parameters.reserve(estimate.parameters.size());
  for (const estimator::ParameterEstimate& from : estimate.parameters) {
    protocol::ParameterEntry& to = document.parameters.emplace_back();
    to.name = from.name;
    to.effect = from.effect;
    to.unit = from.unit;
    to.value = from.value;
    to.standard_error = from.standard_error;
    to.lower = from.lower;
    to.upper = from.upper;
    to.fixed = from.fixed;
    to.at_bound = from.at_bound;
    to.determined = from.determined;
  }
  document.covariance_order = estimate.covariance_order;
  document.covariance = estimate.covariance;
  document.noise_standard_deviation = estimate.noise_standard_deviation;
  document.sum_of_squares = estimate.sum_of_squares;
  document.condition = estimate.condition;
  document.observations = estimate.observations;
  document.degrees_of_freedom = estimate.degrees_of_freedom;
  document.cycles_used = estimate.cycles;
  document.runs_used = estimate.runs;
  document.iterations = estimate.iterations;
  document.converged = estimate.converged;
  document.usable = estimate.usable;
  document.warnings = estimate.warnings;
  return document;
}

}  // namespace shaker::report
