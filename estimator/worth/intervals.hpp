// Other intervals, and other losses, in an estimate that is ready to be published.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "estimator/estimate.hpp"
#include "estimator/estimation.hpp"
#include "estimator/objectives/robust.hpp"

namespace shaker::estimator {

enum class IntervalKind {
  linear,     // (3.29): symmetric, at once
  profile,    // where the likelihood falls: worth/profile.hpp
  bootstrap,  // from 1000 made-up repetitions: worth/bootstrap.hpp
};
std::optional<IntervalKind> interval_kind_from_name(std::string_view name);

// Puts intervals of this kind into `estimate`, which describes the last fit of `estimator` on
// `runs`; a sentence for each end that the data leave open. A fit that did not converge keeps what
// it has.
void replace_intervals(Estimate& estimate, IntervalKind kind, const Model& model,
                       Estimator& estimator, const std::vector<RunData>& runs,
                       const EstimationOptions& options = {});

// Puts a robust fit's values and errors into an estimate of the same data, and names the outliers.
void replace_by_robust(Estimate& estimate, const RobustFit& robust, const Model& model);

}  // namespace shaker::estimator
