#include "estimator/inference/intervals.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/fit/determination.hpp"
#include "estimator/inference/internal/bootstrap.hpp"
#include "estimator/inference/internal/profile.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kMostNamed = 5;

void put(Estimate& estimate, const ProfileInterval& interval) {
  ParameterEstimate& p = estimate.parameters[static_cast<std::size_t>(interval.parameter)];
  p.lower = interval.lower;
  p.upper = interval.upper;
  for (const bool up : {false, true}) {
    if (!(up ? interval.upper_open : interval.lower_open)) continue;
    const double end = up ? interval.upper : interval.lower;
    estimate.warnings.push_back(fmt::format(
        "the data do not limit {} {}: {} is as good as the estimate within the interval's "
        "confidence; add runs at a larger amplitude or another frequency, or give it a prior",
        p.name, up ? "upwards" : "downwards",
        std::isfinite(end) ? fmt::format("{:.4g}, as far as there are solutions or its bound,", end)
                           : "any value"));
  }
}

}  // namespace

std::optional<IntervalKind> interval_kind_from_name(std::string_view name) {
  if (name == "linear") return IntervalKind::linear;
  if (name == "profile") return IntervalKind::profile;
  if (name == "bootstrap") return IntervalKind::bootstrap;
  return std::nullopt;
}

void replace_intervals(Estimate& estimate, IntervalKind kind, const Model& model,
                       Estimator& estimator, const std::vector<RunData>& runs,
                       const EstimationOptions& options) {
  if (estimator.last().status != FitStatus::converged) return;
  if (kind == IntervalKind::profile) {
    for (const ProfileInterval& interval : profile_intervals(estimator, model))
      put(estimate, interval);
  }
  if (kind == IntervalKind::bootstrap) {
    BootstrapOptions choice;
    choice.estimation = options;
    const Bootstrap made = bootstrap(model, estimator, runs, choice);
    for (const BootstrapInterval& interval : made.intervals) {
      ParameterEstimate& p = estimate.parameters[static_cast<std::size_t>(interval.parameter)];
      p.lower = interval.lower;
      p.upper = interval.upper;
    }
    if (made.converged < made.replications)
      estimate.warnings.push_back(
          fmt::format("{} of the bootstrap's {} repetitions did not converge and are left out; "
                      "profile intervals are safer here",
                      made.replications - made.converged, made.replications));
  }
}

void replace_by_robust(Estimate& estimate, const RobustFit& robust, const Model& model) {
  const Fit& fit = robust.fit;
  estimate.covariance = fit.covariance;
  estimate.noise_standard_deviation = robust.scale;
  estimate.iterations += robust.rounds;
  estimate.converged = fit.status == FitStatus::converged;
  estimate.usable = estimate.converged && fit.degrees_of_freedom > 0 &&
                    std::find(fit.at_bound.begin(), fit.at_bound.end(), 1) == fit.at_bound.end();
  estimate.warnings = determination_warnings(model, fit);
  if (!fit.trouble.empty()) estimate.warnings.insert(estimate.warnings.begin(), fit.trouble);
  for (std::size_t k = 0; k < estimate.parameters.size(); ++k) {
    ParameterEstimate& p = estimate.parameters[k];
    p.value = fit.theta[k];
    p.standard_error = fit.standard_error[k];
    const double half = model.parameters()[k].fixed ? 0.0 : fit.quantile * fit.standard_error[k];
    p.lower = p.value - half;
    p.upper = p.value + half;
    p.at_bound = fit.at_bound[k] != 0;
  }
  if (robust.outliers.empty()) return;
  std::vector<std::string> named;
  for (const Outlier& o : robust.outliers) {
    if (named.size() == kMostNamed) break;
    named.push_back(fmt::format("run {} sample {} ({:+.1f})", o.run + 1, o.sample + 1, o.size));
  }
  estimate.warnings.push_back(
      fmt::format("{} sample{} further than 4 times the noise off and count{} for less: {}{}",
                  robust.outliers.size(), robust.outliers.size() == 1 ? " lies" : "s lie",
                  robust.outliers.size() == 1 ? "s" : "", fmt::join(named, ", "),
                  robust.outliers.size() > kMostNamed ? ", ..." : ""));
}

}  // namespace shaker::estimator
