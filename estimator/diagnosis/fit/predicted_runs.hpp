// The predictions of a fit's runs at one set of parameters.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// A run that is fitted, and not held out.
bool is_fitted(const RunDatum& datum);

// Predicts the runs that are fitted. False where one has no solution.
bool predict_all(HarmonicFit& fit, const std::vector<RunDatum>& data,
                 const std::vector<double>& theta, HowFar search);

// Forces along a measured motion exist only where the model is admissible on all of it: a gas
// column must be longer than the stroke. Replaces start values that are not admissible: changes one
// parameter of `fit.theta` by the smallest factor, at most 2, with which all runs can be
// predicted. A wrong unit is a larger factor, and is not mended. False, and nothing changed, where
// there is none, or where responses are compared.
bool admit(HarmonicFit& fit, const std::vector<RunDatum>& data, HowFar search);

// Runs that are held out know the solution where the fit began, which may be far from where it
// ended.
bool predict_held_out(HarmonicFit& fit, const std::vector<RunDatum>& data,
                      const std::vector<double>& began, HowFar search);

}  // namespace shaker::estimator::diagnosis
