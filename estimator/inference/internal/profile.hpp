// Profile-likelihood intervals: one parameter is held at a value and the others are fitted
// again; the interval ends where the fit has become significantly worse.
//
// The linearised interval (3.29) is symmetric and holds only while the model is nearly linear
// within it; the paper states that its covariance gives the order of magnitude only. A profile
// follows the sum of squares: the ends lie where it has risen by t^2 s^2 (Bates and Watts 1988,
// ch. 6; the coverage is exact if some transformation of the parameter makes the problem
// linear). If the data do not limit a parameter, its interval has an open end.
#pragma once

#include <string>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

struct ProfilePoint {
  double value = 0.0;
  double t = 0.0;  // signed root of the scaled rise, comparable to Student's t
};

struct ProfileInterval {
  int parameter = 0;  // index in the model
  double lower = 0.0, upper = 0.0;
  // An open end is a bound, infinity, or the last value for which solutions were found.
  bool lower_open = false, upper_open = false;
  std::vector<ProfilePoint> points;  // ascending in value, with the estimate
};

// The interval of one free, determined parameter after a converged fit; or of all such parameters
// (none if the fit has not converged). The estimator keeps its last fit. Each end costs up to 40
// constrained fits, usually a few; allocates.
ProfileInterval profile_interval(Estimator& estimator, const Model& model, int parameter);
std::vector<ProfileInterval> profile_intervals(Estimator& estimator, const Model& model);

// True if `value` lies inside the interval at the fit's confidence. Costs one constrained fit if
// that succeeds, otherwise a search for the interval.
bool profile_contains(Estimator& estimator, const Model& model, int parameter, double value);

}  // namespace shaker::estimator
