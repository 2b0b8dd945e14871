// From steady cycles to data that can be fitted: means, standard errors, and as many harmonics as
// rise above the noise.
#pragma once

#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/noise/noise.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

struct Weighed {
  std::vector<RunDatum> data;
  double variance_inflation = 1.0;
  // What the response's rounding to its grid adds to the means, over their noise: root mean squares
  // of all runs together. It is in the errors.
  double coarseness = 0.0;
};

// With errors from the scatter of the response alone.
Weighed weigh(const std::vector<SteadyRun>& runs);

// With errors from the scatter of what the measured driver does not explain, cycle by cycle: a
// wandering amplitude so is no noise, and the driver's own noise is. `fit` tells how the response
// follows the driver; its predictions are of `runs`.
Weighed weigh(const std::vector<SteadyRun>& runs, HarmonicFit& fit);

}  // namespace shaker::estimator::diagnosis
