// The diagnosis: detect, locate, name, add, show. See README.md for how it decides.
//
//   auto diagnosis = diagnose(campaign, model, {}, [](auto stage, double share) { ... });
//
// Blocks for about a second; one core; allocates. Deterministic: the same campaign, model and
// options give the same diagnosis.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string_view>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/score/calibration_cache.hpp"

namespace shaker::estimator::diagnosis {

// Of periodic responses, in points of solutions that are linearised (evaluation_budget.hpp), for
// six runs and as much more for more runs: what is best where that ends is the answer, and a
// warning says so. The usual budget is two seconds of one core. An imposed motion has no solution
// to be found.
constexpr double kThorough = std::numeric_limits<double>::infinity();

struct DiagnoseOptions {
  double false_alarm_rate = 0.01;     // over the whole catalogue, 0 < rate < 0.5
  int most_effects = 3;               // that may be missing at once
  int points = 192;                   // of a periodic solution
  int draws = 4000;                   // of the calibration
  double evaluation_budget = 12.5e6;  // kThorough: as long as there is more to try
  std::uint64_t seed = 1;
  CalibrationCache* calibrations = nullptr;  // outlives the call; null: drawn anew each time
};

// `share` of the work that is done, 0..1. To leave early it may throw, anything but
// std::invalid_argument: diagnose() lets it pass and has nothing to clean up.
using Progress = std::function<void(std::string_view stage, double share)>;

// An Error is a sentence for the operator: a run that cannot be used, a model file with an unknown
// effect, a campaign of mixed kinds.
Result<Diagnosis> diagnose(const Campaign& campaign, const config::ModelSpec& model,
                           const DiagnoseOptions& options = {}, const Progress& progress = {});

}  // namespace shaker::estimator::diagnosis
