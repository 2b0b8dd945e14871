// Whether the displacement sensor's zero drifts: the cycles' means move with time, and their shape
// does not.
//
// What moves the mean stroke of a damper changes its stiffness too (gas that leaks or warms), so
// that the harmonics go along in a way that the fitted model knows: its slopes over the parameters.
// A zero that drifts moves the mean and nothing else. Both are held against the lines through the
// cycles of all runs.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/cycles/cut_campaign.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

struct ZeroDrift {
  bool found = false;
  double rate = 0.0, standard_error = 0.0;  // per second, over all runs
  double freedom = 1.0;                     // behind the error
  double chance = 1.0;                      // that noise alone makes such means
  double probability = 0.0;                 // that it is the zero
  bool common = true;                       // one rate does for all runs
  Drifts of_run;
  // Parameter whose change explains the lines as well: the damper may have changed. Empty: none.
  std::string rival;
  std::string instead;  // sentence: something moves, and it is not the zero
};

// `fit` of `runs`, or null where the model could not be fitted: then only steady harmonics speak
// for the sensor.
ZeroDrift zero_drift(const std::vector<SteadyRun>& runs, HarmonicFit* fit);

}  // namespace shaker::estimator::diagnosis
