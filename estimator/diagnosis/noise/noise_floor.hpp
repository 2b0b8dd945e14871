// What noise alone leaves of a gap: its expected size, and the level that it rarely exceeds.
//
// Few harmonics carry the noise of a mean cycle, so that its root mean square differs from campaign
// to campaign by a fifth and more: half of all perfectly explained campaigns leave more than the
// expected noise. The floor therefore is the level below which noise alone stays in 95 of 100 such
// campaigns, after as many parameters have been fitted to it.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

struct NoiseLevel {
  double expected = 0.0, floor = 0.0;  // root mean squares in the response's unit
};
struct NoiseFloor {
  NoiseLevel whole;              // of the runs that were fitted
  std::vector<NoiseLevel> runs;  // the first of the data
};

// Of the first `shown` of the data; what stands behind them (further channels) is fitted too. Noise
// is drawn as the data have it (covariance, standard errors that are estimated themselves, time
// base), the parameters of `fit` are fitted to it, and what is left is measured as the gap is.
NoiseFloor noise_floor(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                       std::size_t shown);

}  // namespace shaker::estimator::diagnosis
