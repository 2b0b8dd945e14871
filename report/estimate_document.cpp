#include "report/estimate_document.hpp"

#include <cmath>
#include <limits>

namespace shaker::report {
namespace {

// A standard error that is so many times the value means that the data do not determine the
// parameter.
constexpr double kMeaningless = 1e3;
constexpr double kMeaninglessOfZero = 1e6;  // for the value 0, in the parameter's unit

bool says_nothing(const estimator::ParameterEstimate& p) {
  if (p.fixed) return false;
  const double size = std::abs(p.value);
  return !(p.standard_error <= (size > 0.0 ? kMeaningless * size : kMeaninglessOfZero));
}

// "theta1 (13.3 +- inf)" -> "theta1 (13.3, not determined)"
std::string in_words(std::string sentence) {
  for (std::size_t at = 0; (at = sentence.find(" +- inf", at)) != std::string::npos;)
    sentence.replace(at, 7, ", not determined");
  return sentence;
}

}  // namespace

protocol::EstimateDocument to_document(const estimator::Estimate& estimate) {
  protocol::EstimateDocument document;
  document.model = estimate.model;
  document.usable = estimate.usable;
  document.intervals_hold = estimate.intervals_hold;
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
    if (from.bias != 0.0) to.bias = from.bias;
    to.fixed = from.fixed;
    to.at_bound = from.at_bound;
    to.determined = from.determined;
    if (says_nothing(from)) {
      to.determined = false;
      to.standard_error = to.lower = to.upper = std::numeric_limits<double>::quiet_NaN();
      document.usable = false;
    }
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
  if (estimate.gap.noise_floor > 0.0) {
    document.gap = estimate.gap.size;
    document.noise_floor = estimate.gap.noise_floor;
  }
  document.warnings.reserve(estimate.warnings.size());
  for (const std::string& warning : estimate.warnings)
    document.warnings.push_back(in_words(warning));
  return document;
}

}  // namespace shaker::report
