// Profile-likelihood intervals: where the other parameters, fitted anew, can no longer make up for
// a parameter that is moved.
//
// The linearised interval (3.29) is symmetric by construction and right only while the model is
// nearly linear within it; the paper says itself that its covariance is of the right order only. A
// profile follows the sum of squares itself: the ends lie where it has risen by t^2 s^2 (Bates and
// Watts 1988, ch. 6; exact coverage whenever some transformation of the parameter makes the
// problem linear). A parameter that the data do not limit has an open end, which is said.
#pragma once

#include <string>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

struct ProfilePoint {
  double value = 0.0;
  double t = 0.0;  // signed root of the excess, to be compared with Student's t
};

struct ProfileInterval {
  int parameter = 0;  // index in the model
  double lower = 0.0, upper = 0.0;
  // The end is not where the likelihood has fallen, but a bound, or as far as solutions were found.
  bool lower_open = false, upper_open = false;
  std::vector<ProfilePoint> points;  // in the order of their values, the estimate among them
};

// Of one free, determined parameter after a converged fit; of all of them. The estimator's last fit
// stays. Allocates a little; a few constrained fits for each end.
ProfileInterval profile_interval(Estimator& estimator, const Model& model, int parameter);
std::vector<ProfileInterval> profile_intervals(Estimator& estimator, const Model& model);

// Is `value` inside the interval of this confidence? One constrained fit instead of a search.
bool profile_contains(Estimator& estimator, const Model& model, int parameter, double value);

}  // namespace shaker::estimator
