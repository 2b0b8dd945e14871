// A measured drop joins what a campaign says of a damper: one more run of the estimate.
//
// For each hypothesis its estimate and covariance are a normal prior, and the measured stroke is a
// record of the transient estimator that begins at touch-down. A hypothesis agrees with the drop
// where noise explains what the fit leaves of the stroke, as a whole and in its slow part, and where
// the parameters stay within what the campaign left open; the chance of a false alarm is 1 %.
//
// Where a hypothesis agrees, its estimate and covariance become those of campaign and drop together.
// Where it does not, they stay as they were: a drop that contradicts narrows nothing. The
// probabilities of the hypotheses follow the evidence of the drop, unless none of them agrees. The
// force that no hypothesis names is not narrowed; it acts with a probability of at least a half where
// the likeliest hypothesis disagrees.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

struct DropRecord {
  std::vector<double> t, stroke;  // s after touch-down, increasing; the model's length unit
  double noise = 0.0;             // standard deviation of a stroke; 0: from the record itself
};

// What the drop says of a hypothesis.
struct HypothesisInDrop {
  bool agrees = false;
  bool joined = false;  // its estimate is that of campaign and drop
  double left = 0.0;    // root mean square of what the fit leaves of the stroke
  double moved = 0.0;   // of the parameters, in their standard errors of the campaign, likewise
  std::string trouble;  // why there is no fit, or why it did not join; else empty
};

struct JoinedDrop {
  IdentifiedDamper damper;                   // the likeliest hypothesis first
  std::vector<HypothesisInDrop> hypotheses;  // in the order of damper.hypotheses
  double noise = 0.0;                        // of a stroke
  std::size_t points = 0;                    // that were used: up to the end of the rebound
  bool intervals_hold = false;               // the likeliest hypothesis agrees
};

// The noise of a record: what its neighbours do not tell of a sample, at the median; at least that of
// its rounding, and 1e-5 of the largest value. Samples must be dense against the motion. NaN for
// fewer than 5. Pure.
double noise_of_record(const std::vector<double>& t, const std::vector<double>& values);

// `damper`: as it falls. An Error where the record has fewer than 20 samples up to the end of the
// rebound. Integrates a few dozen drops for each hypothesis. Throws std::invalid_argument as DropTest
// does.
Result<JoinedDrop> join_drop(const IdentifiedDamper& damper, const DropConditions& conditions,
                             const DropRecord& record);

}  // namespace shaker::estimator
