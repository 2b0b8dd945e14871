// The honest band of a drop: a mixture over the hypotheses that a campaign does not exclude.
//
// Each hypothesis has its own parameters and covariance, and a drop of its own. With the probability
// that something unnamed acts, the first one also has a random force (unnamed_force.hpp), and so has
// each one that is known to leave a force. Draws of all together give the interval. The figures of
// each hypothesis are quadratic along the principal axes of its covariance, from drops at two
// standard errors on either side. Where that is not enough, each draw is a drop of its own.
//
// The effects of sensors and exciter stay on the shaker: they are taken off first.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/drop/internal/drop_priors.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

struct MixtureOptions {
  int draws = 8000;
  int exact_draws = 100;  // of a hypothesis whose figures are not quadratic
  unsigned long seed = 1;
  double confidence = 0.95;
  ExtrapolationPriors priors;  // none: the laws go on beyond the tested velocities
};

struct MixtureBand {
  // Of the first hypothesis; where that is outside of the interval, the median of the mixture.
  double value = 0.0;
  bool median = false;  // the value is the median
  double lower = 0.0, upper = 0.0;
  // Of the first hypothesis alone, linearised: what its parameters leave open.
  double linear_error = 0.0, linear_lower = 0.0, linear_upper = 0.0;
};

// Bands of the curves at some times of the history.
struct HistoryBand {
  std::vector<double> t, stroke_lower, stroke_upper, speed_lower, speed_upper;
  std::vector<double> load_lower, load_upper;
};

// A value that a figure takes, and its share of all draws.
struct WeightedValue {
  double value = 0.0, weight = 0.0;
};

struct DropMixture {
  DropRun run;                     // of the first hypothesis
  std::vector<MixtureBand> bands;  // one for each of kDropFigures
  HistoryBand history;
  // Share of the energy absorbed up to the peak stroke, outside of the strokes and velocities that
  // the campaign visited.
  double extrapolated_energy_share = 1.0;
  double bottoming_probability = 0.0;  // that a draw gives no drop: the stroke ends before it turns
  std::vector<std::vector<WeightedValue>> drawn;  // of each of kDropFigures, sorted
  std::vector<std::string> warnings;

  // The probability that a figure is at most `limit`. Draws without a drop are beyond every limit.
  // NaN for a figure that this gear does not have.
  double probability_within(std::size_t figure, double limit) const;
};

// The conditions of a damper whose stroke was measured with a joint that gives under the load
// (series_compliance) and a transducer that was zeroed under the weight. Nothing without a joint, or
// with one that is a part in series.
std::optional<DropConditions> zeroed_under_weight(const DamperHypothesis& measured,
                                                  DropConditions conditions);

// An Error if the drop of the first hypothesis fails. Blocks for some tenths of a second. Throws
// std::invalid_argument as DropTest does.
Result<DropMixture> predict_drop(const IdentifiedDamper& damper, const DropConditions& conditions,
                                 const MixtureOptions& options = {});

}  // namespace shaker::estimator
