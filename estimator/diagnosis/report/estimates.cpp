#include "estimator/diagnosis/report/internal/estimates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// A place of rest that was fitted makes the parameters less sure.
double bent_error(const HarmonicFit& fit, int parameter,
                  const std::vector<FittedConstant>& places) {
  double error = fit.standard_error(parameter);
  const auto found = std::find(fit.free.begin(), fit.free.end(), parameter);
  for (const FittedConstant& place : places) {
    if (found != fit.free.end())
      error = std::hypot(error, place.bends[found - fit.free.begin()] * place.standard_error);
  }
  return error;
}

bool is_free(const HarmonicFit& fit, std::size_t parameter) {
  return std::ranges::find(fit.free, static_cast<int>(parameter)) != fit.free.end();
}

}  // namespace

std::vector<ParameterEstimate> describe(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                        const std::vector<FittedConstant>& places) {
  double freedom = 0.0, count = 0.0;
  for (const RunDatum& datum : data) {
    freedom += datum.freedom.sum();
    count += static_cast<double>(datum.freedom.size());
  }
  const double quantile = student_t_quantile(0.975, std::max(2.0, freedom / count));
  std::vector<ParameterEstimate> all;
  const auto& parameters = fit.model->parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    ParameterEstimate p;
    p.name = parameters[k].name;
    p.effect = parameters[k].effect;
    p.unit = parameters[k].unit;
    p.value = fit.theta[k];
    p.fixed = parameters[k].fixed;
    p.at_bound = fit.at_bound(static_cast<int>(k));
    p.standard_error = bent_error(fit, static_cast<int>(k), places);
    p.determined =
        p.fixed || (is_free(fit, k) && p.standard_error < 1e3 * (std::fabs(p.value) + 1e-9));
    p.lower = p.value - quantile * p.standard_error;
    p.upper = p.value + quantile * p.standard_error;
    all.push_back(std::move(p));
  }
  const auto tell = [&](const FittedConstant& c, double lowest) {
    ParameterEstimate p;
    p.name = c.symbol;
    p.effect = fit.spec.effects[c.line].effect;
    p.unit = c.unit;
    p.value = c.value;
    p.standard_error = c.standard_error;
    p.lower = std::max(lowest, c.value - quantile * c.standard_error);
    p.upper = c.value + quantile * c.standard_error;
    all.push_back(std::move(p));
  };
  if (fit.constant) tell(*fit.constant, 0.0);
  for (const FittedConstant& place : places)
    tell(place, -std::numeric_limits<double>::infinity());
  return all;
}

config::ModelSpec at_estimates(const HarmonicFit& fit) {
  config::ModelSpec spec = fit.spec;
  const auto& parameters = fit.model->parameters();
  // Those with a value for each run or group: the values in their order, and their mean.
  struct Met {
    std::size_t next = 0;
    int known = 0;
    double sum = 0.0;
  };
  std::map<std::pair<std::size_t, std::string>, Met> met;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    config::ParameterSpec& p = spec.effects[parameters[k].line].parameters[parameters[k].symbol];
    auto& values = p.variation.values;
    if (values.empty()) {
      p.start = fit.theta[k];
      continue;
    }
    auto& [next, known, sum] = met[{parameters[k].line, parameters[k].symbol}];
    values[next++].start = fit.theta[k];
    if (!parameters[k].fixed && !is_free(fit, k)) continue;
    sum += fit.theta[k];
    p.start = sum / ++known;
  }
  return spec;
}

config::ModelSpec with_mean_values(config::ModelSpec spec) {
  for (config::EffectSpec& line : spec.effects) {
    for (auto& [symbol, parameter] : line.parameters) {
      if (!parameter.variation.per.empty()) parameter.variation = {};
    }
  }
  return spec;
}

void warn_of_bounds(Diagnosis& said) {
  for (const ParameterEstimate& p : said.parameters_after) {
    if (p.at_bound && !p.fixed && p.value != 0.0)
      said.warnings.push_back(fmt::format(
          "{} of {} ended at {:.4g} {}, the end of its range: give it a wider one in the model's "
          "file if the damper may need it",
          p.name, p.effect, p.value, p.unit));
  }
}

}  // namespace shaker::estimator::diagnosis
