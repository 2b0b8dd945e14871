// Whether repeated runs agree.
#pragma once

#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// Compares each two runs whose excitations differ by at most 2 % and whose frequencies by 0.2 %.
// `fit` is of `data`: it predicts how the response changes with the small difference of the
// excitations. ErrorKind::invalid names two runs whose responses differ by far more than their
// noise: then at least one of them is wrong.
Result<void> check_agreement(const std::vector<RunDatum>& data, HarmonicFit& fit);

}  // namespace shaker::estimator::diagnosis
