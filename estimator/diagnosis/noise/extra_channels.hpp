// What a campaign measured beside the displacement: a load cell between damper and mass, an
// accelerometer on the damper. Each becomes a datum of its own, with the noise of its own scatter,
// that the same theta must explain; so faults of one sensor no longer look like the damper's.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// To be put behind `data`, which are the runs' displacements; `fit` is of those. The zero of such a
// channel counts for nothing and its gain is trusted to half a percent. An acceleration may be
// against the table or absolute: it is told by the displacement. `notes` says what is used, and
// what is not because it does not look like what it should be.
std::vector<RunDatum> extra_channels(const std::vector<SteadyRun>& runs, const HarmonicFit& fit,
                                     const std::vector<RunDatum>& data,
                                     std::vector<std::string>& notes);
// The channels of `before`, as the quantities that they are there and in its order, read again with
// `data` and with another fit of the same runs: whatever that one would make of the others, fits to
// both are of the same measurements, one behind the other.
std::vector<RunDatum> same_channels(const std::vector<SteadyRun>& runs, const HarmonicFit& fit,
                                    const std::vector<RunDatum>& data,
                                    const std::vector<RunDatum>& before);

}  // namespace shaker::estimator::diagnosis
