// Further channels of a campaign: a load cell between damper and mass, an accelerometer on the
// damper. Each becomes a datum of its own with the noise of its own scatter. The same theta must
// explain it, so that a fault of one sensor no longer looks like an effect of the damper.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Returns data to append to `data`, which are the displacements of `runs`; `fit` is a fit to these.
// The zero of such a channel is ignored, and its gain is trusted to 0.5 %. An acceleration may be
// absolute or relative to the table; the displacement shows which. `notes` receives a sentence for
// each channel that is used, and for each that does not agree with the motion.
std::vector<RunDatum> extra_channels(const std::vector<SteadyRun>& runs, const HarmonicFit& fit,
                                     const std::vector<RunDatum>& data,
                                     std::vector<std::string>& notes);
// Reads the same channels again with `data` and another fit of the same runs. The result has the
// quantities and the order of `before`, so that fits to both have the same measurements.
std::vector<RunDatum> same_channels(const std::vector<SteadyRun>& runs, const HarmonicFit& fit,
                                    const std::vector<RunDatum>& data,
                                    const std::vector<RunDatum>& before);

}  // namespace shaker::estimator::diagnosis
