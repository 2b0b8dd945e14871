// The first fit of the model, from start values that may be far off.
#pragma once

#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// Turns a periodic response into forces along its measured motion: the measured excitation minus
// the inertia, as the force of an imposed motion. For a model with one mechanical coordinate.
RunDatum forces_along_motion(const RunDatum& response, const Model& model);

// Fits the parameters to the forces along the measured motions of runs whose responses are compared. `start`: start
// values, or empty for the model's own. Empty if the forces do not follow from the motion alone, or
// determine nothing.
std::vector<double> fitted_to_forces(const config::ModelSpec& model,
                                     const std::vector<RunDatum>& data,
                                     const std::vector<double>& start, const FitOptions& options);

// True from some four times the chi-squared on that noise alone would make.
bool is_far_above_noise(const HarmonicFit& fit);

// True if what is missing can be looked for beside this fit of the model. Far from the data, a fit
// that still creeps along a valley, or stands where its response is not determined, serves as well
// as one that has ended. The other adds a warning that says so.
bool serves(const HarmonicFit& fit);
void warn_if_unsettled(const HarmonicFit& base, std::vector<std::string>& warnings);

// Compare two fits from different start values. Near noise: another start could not improve it.
// Better: the difference is larger than that of two fits which end in the same valley.
bool is_near_noise(const HarmonicFit& fit);
bool is_better(const HarmonicFit& other, const HarmonicFit& fit);

// The first fit of periodic runs, from the model's own start values. If it does not converge, or
// leaves far more than noise, a second fit starts from the forces along the measured motion, and
// the better one is returned. The forces are nearly linear in the parameters. The response is not:
// with a spring that is several times too stiff, a damper that is driven above its own resonance is
// below the model's, and the response has the opposite sign.
HarmonicFit first_fit(const config::ModelSpec& model, const std::vector<RunDatum>& data,
                      const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
