// The run, or else the channel, that would tell a named effect from its rivals best.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// `named` and `indistinguishable` are fits of the same campaign, each of the model with one of the
// effects. Runs about the campaign's own frequencies and amplitudes are predicted by all of them;
// of those that keep the stroke near where it has been, the one is taken that separates most rivals
// by three standard errors: of the new run's mean cycle, taken as good as the campaign's own, and
// of what the parameters leave open. Where no run separates any, an accelerometer on the damper is
// tried, one that is good to 1 %. Nothing when that would not either, without a rival, and for
// campaigns that are not periodic responses. `separation` is from the nearest of the rivals that it
// separates.
std::optional<DiscriminatingRun> discriminating_run(
    const HarmonicFit& named, const std::vector<const HarmonicFit*>& indistinguishable,
    const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
