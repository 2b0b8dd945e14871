// From steady cycles to data for the fit: means, standard errors, and as many harmonics as exceed
// the noise.
#pragma once

#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/diagnosis/noise/internal/noise.hpp"

namespace shaker::estimator::diagnosis {

struct Weighed {
  std::vector<RunDatum> data;
  double variance_inflation = 1.0;
  // The error of the means from the quantisation of the response, divided by their noise: root mean
  // squares over all runs. It is part of the errors.
  double coarseness = 0.0;
};

// Takes the errors from the scatter of the response alone.
Weighed weigh(const std::vector<SteadyRun>& runs);

// Takes the errors from the part of the scatter that the measured driver does not explain, cycle by
// cycle. Then a wandering amplitude is no noise, and the noise of the driver is. `fit` says how the
// response follows the driver; its predictions are those of `runs`.
Weighed weigh(const std::vector<SteadyRun>& runs, HarmonicFit& fit);

}  // namespace shaker::estimator::diagnosis
