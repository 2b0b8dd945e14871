// One answer to what is missing: effects added to the base model, and the fit of them all.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// The base model with some effects added, refitted.
struct Hypothesis {
  std::vector<std::string> effects;        // those added, sorted
  std::shared_ptr<const HarmonicFit> fit;  // never null
  // A hypothesis with a corner (dry friction) is refitted with sharper corners on finer grids once
  // it matters (smoothing.hpp); `fit` is then that one, `rounded` the first, and `data` are those
  // that it was fitted to.
  std::shared_ptr<const HarmonicFit> rounded;
  std::shared_ptr<const std::vector<RunDatum>> data;  // null: as given
  // A fit that could not be made sharper so that it leaves less than `blunt_above` of chi-squared.
  std::shared_ptr<const HarmonicFit> blunt;
  double blunt_above = 0.0;
  double log_evidence = 0.0;
  std::optional<double> cross_validated;  // log probability of each run given the others, summed
  std::string disqualified;               // why it cannot be; empty: it can
};

// Compared with the corners as round as they are in those that were not made sharper.
const HarmonicFit& rounded(const Hypothesis& h);

}  // namespace shaker::estimator::diagnosis
