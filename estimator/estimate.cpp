#include "estimator/estimate.hpp"

#include <utility>

#include "estimator/fit/records/over_periods.hpp"
#include "estimator/fit/refined_fit.hpp"
#include "estimator/fit/run_comparison.hpp"
#include "estimator/model/run_models.hpp"

namespace shaker::estimator {
namespace {

constexpr int kScreeningPoints = 80;  // coarse: the final fit uses the full grid

Minima searched(const Model& model, const std::vector<RunData>& runs,
                const RunsEstimateOptions& options) {
  EstimationOptions coarse;
  coarse.grid.points = kScreeningPoints;
  StartOptions spread;
  spread.starts = options.starts;
  spread.seed = options.seed;
  return several_starts(model, runs, coarse, model.start(), spread);
}

std::vector<config::RunCondition> conditions_of(const std::vector<RunData>& runs) {
  std::vector<config::RunCondition> conditions;
  for (const RunData& run : runs)
    conditions.push_back(run.condition);
  return conditions;
}

// The models of the runs; one for all where no parameter differs from run to run. Gives each run its
// own.
Result<RunModels> models_of(const config::ModelSpec& spec, std::vector<RunData>& runs) {
  if (!varies_by_run(spec)) return RunModels{{std::make_shared<const Model>(spec)}, {}};
  auto models = run_models(spec, conditions_of(runs));
  if (!models) return models;
  for (std::size_t r = 0; r < runs.size(); ++r)
    runs[r].model = models->of_run[r];
  return models;
}

// The estimate of a fit with the loss, the bias and the intervals that were asked for.
Result<void> describe(RefinedFit& fitted, const Fit& fit, const std::vector<RunData>& runs,
                      const RunsEstimateOptions& options, RunsEstimate& out) {
  const Model& model = *out.model;
  Estimator& estimator = fitted.estimator();
  out.estimate = fitted.describe();
  if (!out.estimate.usable) {
    if (auto doubt = unit_doubt(model, runs.front()); !doubt.empty())
      out.estimate.warnings.insert(out.estimate.warnings.begin(), std::move(doubt));
  }
  if (options.loss != Loss::squared)
    replace_by_robust(out.estimate, fit_robust(model, runs, fit.theta, options.loss, options.fit),
                      model);
  const bool bends = options.loss != Loss::squared || options.intervals != IntervalKind::linear ||
                     options.posterior;
  if (!bends && options.bias != Bias::off)
    take_off_bias(out.estimate, second_order(estimator, model), options.bias);
  if (!options.posterior) {
    replace_intervals(out.estimate, options.intervals, model, estimator, runs, options.fit);
    return {};
  }
  if (fit.status != FitStatus::converged)
    return Error{ErrorKind::not_converged,
                 "there is no single best estimate to sample the posterior around; see "
                 "`--intervals linear` for what the data do not determine"};
  out.sampled = posterior(model, estimator, runs, options.fit);
  replace_by_posterior(out.estimate, *out.sampled);
  return {};
}

}  // namespace

std::vector<ValueInRun> values_in_runs(const RunModels& models,
                                       const std::vector<config::RunCondition>& runs,
                                       const Estimate& estimate) {
  std::vector<ValueInRun> all;
  for (std::size_t r = 0; r < models.varying.size(); ++r) {
    for (const RunParameter& own : models.varying[r]) {
      const ParameterEstimate& p = estimate.parameters[static_cast<std::size_t>(own.index)];
      all.push_back({runs[r].run, own.name, p.unit, own.factor * p.value,
                     own.factor * p.standard_error, own.factor * p.lower, own.factor * p.upper});
    }
  }
  return all;
}

Result<RunsEstimate> estimate(const config::ModelSpec& spec, std::vector<RunData> runs,
                              const RunsEstimateOptions& options) {
  const auto models = models_of(spec, runs);
  if (!models) return models.error();
  RunsEstimate out;
  out.model = models->of_run.front();
  const Model& model = *out.model;
  if (auto why = cannot_repeat_later(model, runs); !why.empty())
    return Error{ErrorKind::invalid, std::move(why)};
  if (options.starts > 1) out.searched = searched(model, runs, options);
  RefinedFit fitted(model, runs, options.fit, accuracy_for(spec, runs, options.accuracy));
  const bool found = out.searched && !out.searched->found.empty();
  const std::vector<double> start = found ? out.searched->found.front().theta : model.start();
  const Fit& fit =
      over_periods(runs) ? fit_over_periods(fitted, model, runs, start) : fitted.fit(start);
  if (fit.status == FitStatus::no_solution) return Error{ErrorKind::not_converged, fit.trouble};
  if (auto good = describe(fitted, fit, runs, options, out); !good) return good.error();
  if (fitted.refined())
    out.grid = {fitted.grids().points(), fitted.grids().error(), fitted.grids().reached(),
                fitted.sentence()};
  out.in_runs = values_in_runs(*models, conditions_of(runs), out.estimate);
  out.pin = pin_areas(spec, out.estimate);
  const MotionOfRuns motion = motion_of_runs(fitted.estimator(), model);
  out.fastest = motion.fastest;
  out.deepest = motion.deepest;
  return out;
}

}  // namespace shaker::estimator
