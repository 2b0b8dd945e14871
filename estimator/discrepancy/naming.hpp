// Which effects are missing: candidates refitted in full, forward, in pairs, then backward.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/discrepancy/calibration_cache.hpp"
#include "estimator/discrepancy/scoring.hpp"

namespace shaker::estimator::discrepancy {

// The base model with some effects added, refitted.
struct Hypothesis {
  std::vector<std::string> effects;        // those added, sorted
  std::shared_ptr<const HarmonicFit> fit;  // never null
  // A hypothesis with a corner (dry friction) is refitted with sharper corners on finer grids once
  // it matters (corners.hpp); `fit` is then that one, `rounded` the first, and `data` are those
  // that it was fitted to.
  std::shared_ptr<const HarmonicFit> rounded;
  std::shared_ptr<const std::vector<RunDatum>> data;  // null: as given
  int fitted_constants = 0;  // places of rest that were fitted besides the parameters
  double log_evidence = 0.0;
  std::optional<double> cross_validated;  // log probability of each run given the others, summed
  std::string disqualified;               // why it cannot be; empty: it can
};

struct NamingOptions {
  FitOptions fit;
  int most_effects = 3;
  int refits = 8;  // of single effects
  // What is simple goes first: of hypotheses that close nearly as much of the gap, the one with the
  // fewest parameters is extended (model_error.hpp).
  bool simple_first = false;
  double false_alarm_rate = 0.01;
  int draws = 4000;
  std::uint64_t seed = 1;
  CalibrationCache* calibrations = nullptr;  // null: drawn anew each time
};

struct Naming {
  Hypothesis base;
  Scoring base_scoring;
  double probability_base = 1.0;       // that noise alone makes the base model's gap
  std::vector<Hypothesis> hypotheses;  // everything that was refitted
  std::size_t best = 0;                // of hypotheses; meaningless when there is none
  double probability_best = 0.0;       // that noise alone makes what is left
  bool adequate = false;               // nothing is missing
  bool explained = false;              // the best leaves nothing but noise
  bool by_gap = false;                 // the errors are what the model leaves (model_error.hpp)
};

Naming name_effects(HarmonicFit base, const std::vector<RunDatum>& data,
                    const std::vector<Candidate>& candidates, const NamingOptions& options,
                    const std::function<void(double)>& progress);

// Log probability of the residuals (Student's t, as the standard errors are estimates) less the
// price of the parameters.
double log_evidence(const HarmonicFit& fit, const std::vector<RunDatum>& data, int added);
// Sum over runs of the log probability of each run under the fit of the others (linearised);
// nothing with fewer than two runs. The residuals of the runs left out, in standard errors, go to
// `left_out` unless it is null.
std::optional<double> cross_validate(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                     std::vector<Eigen::VectorXd>* left_out = nullptr);

}  // namespace shaker::estimator::discrepancy
