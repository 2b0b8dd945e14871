/// \file
/// Replaces the linearised intervals of an estimate by profile or bootstrap intervals, or the whole
/// estimate by a robust one.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "estimator/fit/estimate.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/fit/objectives/robust.hpp"

namespace shaker::estimator {

/// Where intervals come from.
enum class IntervalKind {
  linear,     ///< (3.29): symmetric, without further computation
  profile,    ///< profile likelihood: inference/internal/profile.hpp
  bootstrap,  ///< from 1000 simulated campaigns: inference/internal/bootstrap.hpp
};
/// \param name "linear", "profile" or "bootstrap"
/// \return the kind; nothing for another name
std::optional<IntervalKind> interval_kind_from_name(std::string_view name);

/// Replaces the intervals of `estimate`, which describes the last fit of `estimator` on `runs`, and
/// adds a warning for each end that the data leave open. Changes nothing for `linear`, or when the
/// fit has not converged.
/// \param estimate of the last fit; its intervals are replaced
/// \param kind of the intervals
/// \param model of the estimator
/// \param estimator has made the fit
/// \param runs its data
/// \param options its options
void replace_intervals(Estimate& estimate, IntervalKind kind, const Model& model,
                       Estimator& estimator, const std::vector<RunData>& runs,
                       const EstimationOptions& options = {});

/// Replaces the values, standard errors and intervals by those of a robust fit of the same data. A
/// warning names the outliers.
/// \param estimate of the same data
/// \param robust the robust fit
/// \param model of both
void replace_by_robust(Estimate& estimate, const RobustFit& robust, const Model& model);

}  // namespace shaker::estimator
