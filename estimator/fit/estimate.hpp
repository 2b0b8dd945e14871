/// \file
/// The result of an estimation: parameters with their uncertainty. Plain data without library
/// types, so that every part of the program can include it.
///
/// Sources: covariance (3.27) with s^2 from (3.28); intervals (3.29), but with the quantile of
/// Student's t for the degrees of freedom instead of 1.96. `condition` is that of the Jacobian with
/// its columns scaled to unit length.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace shaker::estimator {

/// One parameter with its uncertainty. Values are in `unit`.
struct ParameterEstimate {
  std::string name;             ///< symbol in the model, e.g. "theta1"
  std::string effect;           ///< e.g. "orifice_damping"
  std::string unit;             ///< for example "1/m"; empty: dimensionless
  double value = 0.0;           ///< the estimate; for a fixed parameter its start
  double standard_error = 0.0;  ///< NaN if undetermined
  /// Interval, 95 % by default.
  /// @{
  double lower = 0.0, upper = 0.0;
  /// @}
  bool fixed = false;      ///< the fit did not change it; its standard error is 0
  bool at_bound = false;   ///< the estimate lies at a bound
  bool determined = true;  ///< false: the data do not determine it; see Estimate::warnings
  /// Bias that was subtracted from the optimum to give `value` (inference/second_order.hpp). 0:
  /// `value` is the optimum.
  double bias = 0.0;
};

/// A parameter that changed while a run was measured (online/internal/change_detector.hpp).
struct ParameterChange {
  /// Symbol and unit of the parameter.
  /// @{
  std::string name, unit;
  /// @}
  int run = 0;       ///< index of the run in the campaign
  long cycle = 0;    ///< of the run; about the first cycle after the change
  long seen_at = 0;  ///< the cycle at which the test detected it
  /// The change and its standard error, in the parameter's unit.
  /// @{
  double jump = 0.0, standard_error = 0.0;
  /// @}
  double before = 0.0;  ///< value before the change
  /// What the test compared. The change was detected where the statistic exceeded the threshold.
  /// @{
  double statistic = 0.0, threshold = 0.0;
  /// @}
  /// True if the change of this parameter alone explains all that was detected.
  bool alone = true;
  /// \return a sentence for the operator
  std::string sentence() const;
};

/// How far the model misses the mean cycles: root mean squares over the mean cycles of all runs
/// with repeated cycles, in the model's length unit. NaN if there are too few cycles to know the
/// noise.
struct ModelGap {
  double size = std::numeric_limits<double>::quiet_NaN();         ///< measured less simulated
  double noise_floor = std::numeric_limits<double>::quiet_NaN();  ///< what scatter alone explains
  int worst_run = 0;  ///< index of the run whose gap is largest as a multiple of its own noise
};

/// All that one estimation says.
struct Estimate {
  std::string model;                          ///< name of the model
  std::vector<ParameterEstimate> parameters;  ///< all of them, in the model's order
  std::vector<double> covariance;  ///< free x free parameters, row by row, in their order
  std::vector<std::string> covariance_order;  ///< names of the free parameters in `covariance`
  double noise_standard_deviation = 0.0;      ///< s of (3.28), in the model's length unit
  double sum_of_squares = 0.0;        ///< of the weighted residuals, with the scatter of the cycles
  double condition = 0.0;             ///< scaled condition number of the Jacobian
  long observations = 0;              ///< number of data
  long degrees_of_freedom = 0;        ///< observations less free parameters
  long cycles = 0;                    ///< number of cycles in the estimate
  int runs = 0;                       ///< number of runs in the estimate
  int iterations = 0;                 ///< of the last fit
  bool converged = false;             ///< the last fit reached its tolerance
  bool usable = false;                ///< converged, determined, in the bounds, right branch
  ModelGap gap;                       ///< error of the model, which the intervals do not include
  bool intervals_hold = true;         ///< false: the gap is more than noise explains
  std::vector<std::string> warnings;  ///< sentences for the operator
  std::vector<ParameterChange> changes;  ///< that the test detected at this cycle
};

}  // namespace shaker::estimator
