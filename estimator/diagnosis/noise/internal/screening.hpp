// Screening: cuts a periodic campaign into cycles, computes their errors and fits the model for the
// first time. A drift of the sensor's zero is read from the records and removed before anything
// else is judged.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "estimator/diagnosis/noise/internal/zero_drift.hpp"

namespace shaker::estimator::diagnosis {

// Runs and the fit of the model to their means, with errors from the scatter of the response alone.
struct Look {
  std::vector<SteadyRun> runs;
  Weighed weighed;
  HarmonicFit fit;
  bool fitted() const;  // otherwise `fit` says its trouble
};

struct Screening {
  Look look;
  ZeroDrift drift;
  std::optional<Look> with_drift;  // as it was recorded; only where a drift was taken out
  std::vector<std::string> warnings;
};

// Errors are those of cut_campaign and plausible.
Result<Screening> screen_campaign(const Campaign& campaign, const config::ModelSpec& model,
                                  const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
