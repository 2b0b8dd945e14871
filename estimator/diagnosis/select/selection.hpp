// Which effects are missing: candidates refitted in full, forward, in pairs, then backward.
#pragma once

#include <functional>
#include <vector>

#include "estimator/diagnosis/score/calibration_cache.hpp"
#include "estimator/diagnosis/score/scoring.hpp"
#include "estimator/diagnosis/select/hypothesis.hpp"

namespace shaker::estimator::diagnosis {

struct SelectionOptions {
  FitOptions fit;
  int most_effects = 3;
  int refits = 8;  // of single effects
  // What is simple goes first: of hypotheses that close nearly as much of the gap, the one with the
  // fewest parameters is extended (model_error.hpp).
  bool simple_first = false;
  // Of an earlier search on the same runs: fitted again from where it was, before any other.
  const Hypothesis* known = nullptr;
  // Share of the diagnosis' budget that is left to later searches: where no more is left, what is
  // best by then stands.
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

// The base model only: whether anything is missing.
Selection judge(HarmonicFit base, const std::vector<RunDatum>& data,
                const std::vector<Candidate>& candidates, const SelectionOptions& options);
// And what is missing.
Selection select_effects(HarmonicFit base, const std::vector<RunDatum>& data,
                         const std::vector<Candidate>& candidates, const SelectionOptions& options,
                         const std::function<void(double)>& progress);
// A search by shares of a gap (simple_first) leaves corners as sharp as finer grids make them; this
// takes those of one hypothesis to no width, where that leaves less and is admissible.
void take_to_no_width(Selection& found, std::size_t hypothesis, const std::vector<RunDatum>& data,
                      const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
