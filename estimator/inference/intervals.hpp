// Replaces the linearised intervals of an estimate by profile or bootstrap intervals, or the whole
// estimate by a robust one.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "estimator/estimate.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/objectives/robust.hpp"

namespace shaker::estimator {

enum class IntervalKind {
  linear,     // (3.29): symmetric, without further computation
  profile,    // profile likelihood: inference/profile.hpp
  bootstrap,  // from 1000 simulated campaigns: inference/bootstrap.hpp
};
std::optional<IntervalKind> interval_kind_from_name(std::string_view name);

// Replaces the intervals of `estimate`, which describes the last fit of `estimator` on `runs`, and
// adds a warning for each end that the data leave open. Changes nothing for `linear`, or when the
// fit has not converged.
void replace_intervals(Estimate& estimate, IntervalKind kind, const Model& model,
                       Estimator& estimator, const std::vector<RunData>& runs,
                       const EstimationOptions& options = {});

// Replaces the values, standard errors and intervals by those of a robust fit of the same data. A
// warning names the outliers.
void replace_by_robust(Estimate& estimate, const RobustFit& robust, const Model& model);

}  // namespace shaker::estimator
