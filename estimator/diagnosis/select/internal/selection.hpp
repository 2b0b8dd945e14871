// Selects the missing effects: refits candidates in full, adds effects one after another, tries
// pairs, then removes effects that are not needed.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "estimator/diagnosis/score/calibration_cache.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"
#include "estimator/diagnosis/select/internal/hypothesis.hpp"

namespace shaker::estimator::diagnosis {

struct SelectionOptions {
  FitOptions fit;
  int most_effects = 3;
  int refits = 8;  // of single effects
  // The errors are what a first search left (model_error.hpp).
  bool by_gap = false;
  // A hypothesis of an earlier search on the same runs; it is fitted again first.
  const Hypothesis* known = nullptr;
  // What an earlier search on the same runs knows of the probes; null: nothing.
  std::shared_ptr<ProbedAll> probed = nullptr;
  // Share of the diagnosis' budget to leave for later searches. When no more is left, the best
  // hypothesis so far stands.
  double leave = 0.0;
  double false_alarm_rate = 0.01;
  int draws = 4000;
  std::uint64_t seed = 1;
  CalibrationCache* calibrations = nullptr;  // null: drawn anew each time
};

struct Selection {
  Hypothesis base;
  Scoring base_scoring;
  double probability_base = 1.0;       // that noise alone makes the base model's gap
  std::vector<Hypothesis> hypotheses;  // everything that was refitted
  std::size_t best = 0;                // of hypotheses; meaningless when there is none
  double probability_best = 0.0;       // that noise alone makes what is left
  bool adequate = false;               // nothing is missing
  bool explained = false;              // the best leaves nothing but noise
  bool cut_short = false;              // more would have been tried
  bool by_gap = false;                 // the errors are what the model leaves (model_error.hpp)
};

// Judges the base model only: is anything missing?
Selection judge(HarmonicFit base, const std::vector<RunDatum>& data,
                const std::vector<Candidate>& candidates, const SelectionOptions& options);
// Judges the base model, then searches for what is missing.
Selection select_effects(HarmonicFit base, const std::vector<RunDatum>& data,
                         const std::vector<Candidate>& candidates, const SelectionOptions& options,
                         const std::function<void(double)>& progress);
// A search by shares of the gap (by_gap) stops at the finer grids. This takes one hypothesis
// to zero smoothing width, if that leaves less and is admissible.
void take_to_zero_width(Selection& found, std::size_t hypothesis, const std::vector<RunDatum>& data,
                        const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
