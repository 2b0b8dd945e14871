// The result of an estimation: parameters with their uncertainty. Plain data without library types,
// so that every part of the program can include it.
//
// Sources: covariance (3.27) with s^2 from (3.28); intervals (3.29), but with the quantile of
// Student's t for the degrees of freedom instead of 1.96. `condition` is that of the Jacobian with
// its columns scaled to unit length.
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
  double standard_error = 0.0;      // NaN if undetermined
  double lower = 0.0, upper = 0.0;  // interval, 95 % by default
  bool fixed = false;
  bool at_bound = false;
  bool determined = true;  // false: the data do not determine it; see Estimate::warnings
  // Bias that was subtracted from the optimum to give `value` (inference/second_order.hpp). 0:
  // `value` is the optimum.
  double bias = 0.0;
};

// A parameter that changed while a run was measured (online/change_detector.hpp).
struct ParameterChange {
  std::string name, unit;
  int run = 0;
  long cycle = 0;    // of the run; about the first cycle after the change
  long seen_at = 0;  // the cycle at which the test detected it
  double jump = 0.0, standard_error = 0.0;
  double before = 0.0;  // value before the change
  double statistic = 0.0, threshold = 0.0;
  // True if the change of this parameter alone explains all that was detected.
  bool alone = true;
  std::string sentence() const;  // for the operator
};

// How far the model misses the mean cycles: root mean squares over the mean cycles of all runs with
// repeated cycles, in the model's length unit. NaN if there are too few cycles to know the noise.
struct ModelGap {
  double size = std::numeric_limits<double>::quiet_NaN();         // measured less simulated
  double noise_floor = std::numeric_limits<double>::quiet_NaN();  // what scatter alone explains
  int worst_run = 0;  // index of the run whose gap is largest as a multiple of its own noise
};

struct Estimate {
  std::string model;
  std::vector<ParameterEstimate> parameters;
  std::vector<double> covariance;             // free parameters only, row by row, in their order
  std::vector<std::string> covariance_order;  // names of the free parameters in `covariance`
  double noise_standard_deviation = 0.0;      // s of (3.28), in the model's length unit
  double sum_of_squares = 0.0;
  double condition = 0.0;  // scaled condition number of the Jacobian
  long observations = 0;
  long degrees_of_freedom = 0;
  long cycles = 0;  // number of cycles in the estimate
  int runs = 0;
  int iterations = 0;
  bool converged = false;
  bool usable = false;                   // converged, determined, in the bounds, right branch
  ModelGap gap;                          // error of the model, which the intervals do not include
  bool intervals_hold = true;            // false: the gap is more than noise explains
  std::vector<std::string> warnings;     // sentences for the operator
  std::vector<ParameterChange> changes;  // that the test detected at this cycle
};

}  // namespace shaker::estimator
