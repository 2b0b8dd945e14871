// The run, or otherwise the channel, that best separates a named effect from its indistinguishable
// set.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// `named` and `indistinguishable` are fits of one campaign, each with one of the effects. All of
// them predict runs near the campaign's own frequencies and amplitudes. Of the runs that keep the
// stroke near its measured range, the one is chosen that separates most hypotheses from `named` by
// three standard errors. The errors are those of a mean cycle as good as the campaign's, and those
// of the parameters. If no run separates any, an accelerometer on the damper with an accuracy of 1
// % is tried. Empty if that does not help either, if there is no other hypothesis, and for
// campaigns other than periodic responses. `separation` is the distance to the nearest hypothesis
// that the run separates.
std::optional<DiscriminatingRun> discriminating_run(
    const HarmonicFit& named, const std::vector<const HarmonicFit*>& indistinguishable,
    const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
