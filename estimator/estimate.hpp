// What an estimation gives: parameters with what they are worth. Plain data, no library types, so
// that everyone can include it.
//
// Sources: covariance (3.27) with s^2 from (3.28); intervals (3.29) with Student's t quantile of
// the degrees of freedom instead of 1.96; condition of the Jacobian with columns scaled to unit
// length.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace shaker::estimator {

struct ParameterEstimate {
  std::string name;    // symbol in the model, e.g. "theta1"
  std::string effect;  // e.g. "orifice_damping"
  std::string unit;
  double value = 0.0;
  double standard_error = 0.0;      // NaN when undetermined
  double lower = 0.0, upper = 0.0;  // 95 % interval
  bool fixed = false;
  bool at_bound = false;
  bool determined = true;  // false: the data do not fix it; see Estimate::warnings
  // That was taken off the optimum to give `value` (worth/second_order.hpp); 0: it is the optimum.
  double bias = 0.0;
};

// A parameter that changed while a run was measured (online/change_detector.hpp).
struct ParameterChange {
  std::string name, unit;
  int run = 0;
  long cycle = 0;    // of the run, about the first after the change
  long seen_at = 0;  // the cycle at which the test said so
  double jump = 0.0, standard_error = 0.0;
  double before = 0.0;  // what it was taken for
  double statistic = 0.0, threshold = 0.0;
  // This parameter's change alone explains all that was seen.
  bool alone = true;
  std::string sentence() const;  // for the operator
};

// Root mean squares over the mean cycles of all runs that repeat, in the model's unit of length.
// NaN where too few cycles tell the noise.
struct ModelGap {
  double size = std::numeric_limits<double>::quiet_NaN();         // measured less simulated
  double noise_floor = std::numeric_limits<double>::quiet_NaN();  // what scatter alone explains
  int worst_run = 0;                                              // as a multiple of its own noise
};

struct Estimate {
  std::string model;
  std::vector<ParameterEstimate> parameters;
  std::vector<double> covariance;             // free parameters only, row by row, in their order
  std::vector<std::string> covariance_order;  // names of those
  double noise_standard_deviation = 0.0;      // s of (3.28), m
  double sum_of_squares = 0.0;
  double condition = 0.0;  // scaled condition number of the Jacobian
  long observations = 0;
  long degrees_of_freedom = 0;
  long cycles = 0;  // that count in it
  int runs = 0;
  int iterations = 0;
  bool converged = false;
  bool usable = false;                   // converged, determined, inside the bounds
  ModelGap gap;                          // what the intervals do not count: a model that is wrong
  std::vector<std::string> warnings;     // sentences for the operator
  std::vector<ParameterChange> changes;  // that the test saw at this cycle
};

}  // namespace shaker::estimator
