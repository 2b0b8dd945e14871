// The estimate of a model from periodic runs: all that stands between runs and an Estimate. It
// chooses the start, the grid and the fit, and applies loss, bias and intervals.
//
// Parameters may differ from run to run (model/run_models.hpp), and responses may repeat only after
// several periods (time/over_periods.hpp).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/estimate.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/fit/pin_areas.hpp"
#include "estimator/fit/several_starts.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/posterior.hpp"
#include "estimator/inference/second_order.hpp"
#include "estimator/objectives/robust.hpp"

namespace shaker::estimator {

struct RunsEstimateOptions {
  EstimationOptions fit;
  double accuracy = 0.0;  // relative, of the parameters; 0: that of accuracy_for()
  int starts = 1;         // above 1: several_starts()
  std::uint32_t seed = 1;
  // The bias is that of the squared loss with linear intervals; with others it stays.
  Loss loss = Loss::squared;
  Bias bias = Bias::automatic;
  IntervalKind intervals = IntervalKind::linear;
  bool posterior = false;  // its intervals instead
};

// A parameter that differs from run to run, as it is in one of them.
struct ValueInRun {
  std::string run, name, unit;
  double value = 0.0, standard_error = 0.0, lower = 0.0, upper = 0.0;
};

struct RunsEstimate {
  Estimate estimate;
  std::shared_ptr<const Model> model;  // of all runs together
  std::optional<Minima> searched;      // if several starts were asked for
  std::optional<Posterior> sampled;    // if the posterior was asked for
  std::vector<ValueInRun> in_runs;
  std::vector<AreaAtKnot> pin;
  struct Grid {
    int points = 0;
    double error = 0.0;  // of theta, relative; infinite: not known
    bool reached = false;
    std::string sentence;
  };
  std::optional<Grid> grid;  // if it was refined
};

// `spec`: priors count where they are. An Error names the run that lacks a group or a condition, a
// model that has no response over several periods (both `invalid`), or says that there is no
// periodic solution or no posterior (`not_converged`). Throws std::invalid_argument for runs or a
// model that cannot be used. Blocks for milliseconds, with a posterior for minutes; allocates.
Result<RunsEstimate> estimate_runs(const config::ModelSpec& spec, std::vector<RunData> runs,
                                   const RunsEstimateOptions& options = {});

}  // namespace shaker::estimator
