// The gap that noise alone leaves: its expected size, and the level that it rarely exceeds.
//
// Few harmonics carry the noise of a mean cycle. Its root mean square therefore differs from
// campaign to campaign by a fifth and more, and half of all perfectly explained campaigns leave
// more than the expected noise. The floor is the level below which noise alone stays in 95 of 100
// such campaigns, after as many parameters have been fitted to it.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

struct NoiseLevel {
  double expected = 0.0, floor = 0.0;  // root mean squares in the response's unit
};
struct NoiseFloor {
  NoiseLevel whole;              // of the runs that were fitted
  std::vector<NoiseLevel> runs;  // the first of the data
};

// The noise floor of the first `shown` of the data; the data after them (further channels) are
// fitted too. Draws noise with the properties of the data (covariance, standard errors that are
// themselves estimates, time base), fits the parameters of `fit` to it, and measures the rest as
// the gap is measured.
NoiseFloor noise_floor(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                       std::size_t shown);

}  // namespace shaker::estimator::diagnosis
