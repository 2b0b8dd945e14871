// A hypothesis: the base model with added effects, and its fit.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// The base model with some effects added, refitted.
struct Hypothesis {
  std::vector<std::string> effects;        // those added, sorted
  std::shared_ptr<const HarmonicFit> fit;  // never null
  // A hypothesis with a corner (dry friction) is refitted with narrower smoothing on finer grids
  // once that matters (smoothing.hpp). Then `fit` is the narrow fit, `rounded` the first one, and
  // `data` are the data of the narrow fit.
  std::shared_ptr<const HarmonicFit> rounded;
  std::shared_ptr<const std::vector<RunDatum>> data;  // null: as given
  // A fit for which narrower smoothing did not lead below a chi-squared of `blunt_above`; it is not
  // tried again.
  std::shared_ptr<const HarmonicFit> blunt;
  double blunt_above = 0.0;
  int added = 0;  // parameters and constants, to those of the base model
  double log_evidence = 0.0;
  std::optional<double> cross_validated;  // log probability of each run given the others, summed
  std::string disqualified;               // why it cannot be; empty: it can
};

// The fit with the first smoothing, for comparison with hypotheses that have no narrower one.
const HarmonicFit& rounded(const Hypothesis& h);

}  // namespace shaker::estimator::diagnosis
