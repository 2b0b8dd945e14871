// What noise alone leaves of a gap: its expected size, and the level that it rarely exceeds.
//
// Few harmonics carry the noise of a mean cycle, so that its root mean square differs from campaign
// to campaign by a fifth and more: half of all perfectly explained campaigns leave more than the
// expected noise. The floor therefore is the level below which noise alone stays in 95 of 100 such
// campaigns, after as many parameters have been fitted to it.
#pragma once

#include <vector>

#include "estimator/discrepancy/diagnosis.hpp"
#include "estimator/discrepancy/harmonic_fit.hpp"

namespace shaker::estimator::discrepancy {

// Sets noise and noise_floor of the gap and of its runs, which are those of `data` in order; what
// stands behind them (further channels) is fitted too. Noise is drawn as the data have it
// (covariance, standard errors that are estimated themselves, time base), the parameters of `fit`
// are fitted to it, and what is left is measured as the gap is.
void tell_noise(const HarmonicFit& fit, const std::vector<RunDatum>& data, Diagnosis& said);

}  // namespace shaker::estimator::discrepancy
