/// \file
/// The estimate of a model from periodic runs: all that stands between runs and an Estimate. It
/// chooses the start, the grid and the fit, and applies loss, bias and intervals.
///
/// Parameters may differ from run to run (model/run_models.hpp), and responses may repeat only after
/// several periods (fit/records/over_periods.hpp).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/fit/estimate.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/fit/objectives/robust.hpp"
#include "estimator/fit/pin_areas.hpp"
#include "estimator/fit/several_starts.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/posterior.hpp"
#include "estimator/inference/second_order.hpp"

namespace shaker::estimator {

/// What is asked of estimate().
struct RunsEstimateOptions {
  EstimationOptions fit;        ///< how each fit steps
  double accuracy = 0.0;        ///< relative, of the parameters; 0: that of accuracy_for()
  int starts = 1;               ///< above 1: several_starts()
  std::uint32_t seed = 1;       ///< of the starts
  Loss loss = Loss::squared;    ///< of a residual
  Bias bias = Bias::automatic;  ///< for the squared loss with linear intervals; else it stays
  IntervalKind intervals = IntervalKind::linear;  ///< where they come from
  bool posterior = false;                         ///< intervals of the posterior instead
};

/// A parameter that differs from run to run, as it is in one of them.
struct ValueInRun {
  std::string run;              ///< name of the run
  std::string name;             ///< of the parameter
  std::string unit;             ///< of the parameter
  double value = 0.0;           ///< in that run
  double standard_error = 0.0;  ///< of the value
  /// Interval of the value.
  /// @{
  double lower = 0.0, upper = 0.0;
  /// @}
};

/// What estimate() finds.
struct RunsEstimate {
  Estimate estimate;                   ///< values, standard errors, intervals, warnings
  std::shared_ptr<const Model> model;  ///< of all runs together
  std::optional<Minima> searched;      ///< if several starts were asked for
  std::optional<Posterior> sampled;    ///< if the posterior was asked for
  std::vector<ValueInRun> in_runs;     ///< parameters that differ from run to run
  std::vector<AreaAtKnot> pin;         ///< of a metering pin's table
  /// Of the fit: the largest speed and stroke, in the model's units.
  /// @{
  double fastest = 0.0, deepest = 0.0;
  /// @}
  /// The grid of the final fit.
  struct Grid {
    int points = 0;        ///< in a period
    double error = 0.0;    ///< of theta, relative; infinite: not known
    bool reached = false;  ///< the accuracy that was asked for
    std::string sentence;  ///< for a person
  };
  std::optional<Grid> grid;  ///< if it was refined
};

struct RunModels;

/// The parameters that differ from run to run, in each run. Pure; allocates.
/// \param models of the runs (estimator/model/run_models.hpp)
/// \param runs one condition for each run, whose name the values get
/// \param estimate of the parameters of all runs together
/// \return the first run's values first; none where no parameter differs
std::vector<ValueInRun> values_in_runs(const RunModels& models,
                                       const std::vector<config::RunCondition>& runs,
                                       const Estimate& estimate);

/// Does what `shakerctl estimate` does between its input and its document. Throws
/// std::invalid_argument for runs or a model that cannot be used. Blocks for milliseconds, with a
/// posterior for minutes; allocates.
/// \param spec the model file; its priors count
/// \param runs one element for each run, lengths in the model's unit
/// \param options what is asked for
/// \return the estimate. An Error names the run that lacks a group or a condition, or a model that
///   has no response over several periods (both `invalid`), or says that there is no periodic
///   solution or no posterior (`not_converged`)
Result<RunsEstimate> estimate(const config::ModelSpec& spec, std::vector<RunData> runs,
                              const RunsEstimateOptions& options = {});

}  // namespace shaker::estimator
