// Fits the base model to records, and completes their errors by what the fit shows: noise of the
// excitation, zeros and constant forces of the records' own.
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"
#include "estimator/diagnosis/noise/internal/own_forces.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"

namespace shaker::estimator::diagnosis {

struct FittedRecords {
  HarmonicFit base;
  std::optional<OwnForces> own_forces;
};

// `unit`: of what is compared, for the operator. `largest`: force of the motion. Adds to the runs'
// warnings. An Error says that no fit serves.
Result<FittedRecords> fit_records(const config::ModelSpec& model, const std::string& unit,
                                  double largest, FitOptions options, TransientRuns& runs);

// Why nothing can be compared without a fit of the base model.
Error not_fitted(const HarmonicFit& fit);

}  // namespace shaker::estimator::diagnosis
