// Whether the zero of the displacement sensor drifts: the means of the cycles move with time, and
// their shape does not change.
//
// A change in the damper that moves its mean stroke also changes its stiffness (gas that leaks or
// warms). The harmonics then change too, in proportions that the derivatives of the fitted model
// give. A drift of the zero moves the mean and nothing else. Both explanations are compared with
// the lines through the cycles of all runs.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/cycles/internal/cut_campaign.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

struct ZeroDrift {
  bool found = false;
  double rate = 0.0, standard_error = 0.0;  // per second, over all runs
  double freedom = 1.0;                     // behind the error
  double chance = 1.0;                      // that noise alone makes such means
  double probability = 0.0;                 // that it is the zero
  bool common = true;                       // one rate does for all runs
  Drifts of_run;
  // A parameter whose change explains the lines equally well: perhaps the damper has changed.
  // Empty: none.
  std::string rival;
  std::string instead;  // sentence: something moves, and it is not the zero
};

// `fit`: the fit of `runs`, or null if the model could not be fitted. Then only harmonics that stay
// constant show that it is the sensor.
ZeroDrift zero_drift(const std::vector<SteadyRun>& runs, HarmonicFit* fit);

}  // namespace shaker::estimator::diagnosis
