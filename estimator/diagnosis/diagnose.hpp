/// \file
/// The diagnosis: detect, locate, name, add, show. See README.md for how it decides.
///
///   auto diagnosis = diagnose(campaign, model, {}, [](auto stage, double share) { ... });
///
/// Blocks for about a second; one core; allocates. Deterministic: the same campaign, model and
/// options give the same diagnosis.
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

/// An evaluation budget without end.
constexpr double kThorough = std::numeric_limits<double>::infinity();

/// How far a diagnosis goes.
struct DiagnoseOptions {
  double false_alarm_rate = 0.01;  ///< over the whole catalogue, 0 < rate < 0.5
  int most_effects = 3;            ///< that may be missing at once; 0: nothing is named
  int points = 192;                ///< of a periodic solution
  int draws = 4000;                ///< of the calibration
  /// For periodic responses: points of solutions that are linearised, for six runs, and as much
  /// more for more runs. What is best where that ends is the answer, and a warning says so. The
  /// default is two seconds of one core. kThorough: as long as there is more to try.
  double evaluation_budget = 15e6;
  std::uint64_t seed = 1;                    ///< of the calibration's random numbers
  CalibrationCache* calibrations = nullptr;  ///< outlives the call; null: drawn anew each time
};

/// `share` of the work that is done, 0..1. To leave early it may throw, anything but
/// std::invalid_argument: diagnose() lets it pass and has nothing to clean up.
using Progress = std::function<void(std::string_view stage, double share)>;

/// An Error is a sentence for the operator: a run that cannot be used, a model file with an unknown
/// effect, a campaign of mixed kinds.
/// \param campaign the runs, all of one kind
/// \param model the model as it is, to which effects may be added
/// \param options how far to go
/// \param progress is called in this thread as the work goes on; may be empty
/// \return the diagnosis; error `not_converged`: the model itself cannot be fitted
Result<Diagnosis> diagnose(const Campaign& campaign, const config::ModelSpec& model,
                           const DiagnoseOptions& options = {}, const Progress& progress = {});

}  // namespace shaker::estimator::diagnosis
