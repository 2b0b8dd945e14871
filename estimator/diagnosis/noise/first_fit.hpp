// The first fit of the model, from start values that may be far off.
#pragma once

#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// The balance of forces along the measured periodic motion in place of the response: what is left
// of the excitation without inertia, as the force of an imposed motion. Of a model of one
// mechanical coordinate.
RunDatum forces_along_motion(const RunDatum& response, const Model& model);

// Parameters by the forces along the measured motions of periodic runs, from `start` (empty: the
// model's own); empty where those do not follow from the motion alone, or say nothing.
std::vector<double> fitted_to_forces(const config::ModelSpec& model,
                                     const std::vector<RunDatum>& data,
                                     const std::vector<double>& start, const FitOptions& options);

// Of two fits from different start values. Near noise: another start would not do better. Better:
// by more than two fits that end in one valley differ.
bool is_near_noise(const HarmonicFit& fit);
bool is_better(const HarmonicFit& other, const HarmonicFit& fit);

// For periodic runs: from the model's own start values; where that does not settle, or leaves far more than noise,
// also from what the forces along the measured motion say, which are nearly linear in the
// parameters: of a spring some times too stiff the response, driven below that model's resonance
// and above its own, points the wrong way. The better of the two.
HarmonicFit first_fit(const config::ModelSpec& model, const std::vector<RunDatum>& data,
                      const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
