// The predictions of a fit's runs at one set of parameters.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// True if a run is fitted and not held out.
bool is_fitted(const RunDatum& datum);

// Predicts the fitted runs. Returns false if one has no solution.
bool predict_all(HarmonicFit& fit, const std::vector<RunDatum>& data,
                 const std::vector<double>& theta, HowFar search);

// True if the forces of all runs are compared along their measured motions.
bool along_motion(const std::vector<RunDatum>& data);

// Corrects start values with which some run cannot be predicted: forces along a measured motion exist
// only if the gas column is longer than the stroke, and responses only if they can follow the record.
// Multiplies one parameter of `fit.theta` by the smallest factor, at most 2, with which all runs can
// be predicted. A wrong unit needs a larger factor and is not corrected. Returns false, and changes
// nothing, if no factor helps.
bool admit(HarmonicFit& fit, const std::vector<RunDatum>& data, HowFar search);

// Predicts the held-out runs. Their last solution is that of `began`, where the fit started, which
// may be far from its end.
bool predict_held_out(HarmonicFit& fit, const std::vector<RunDatum>& data,
                      const std::vector<double>& began, HowFar search);

}  // namespace shaker::estimator::diagnosis
