// Scores of pairs: what two effects gain together, though one of them alone may seem to gain
// nothing. Drag beside dry friction has the wrong sign alone, because the model's viscous damping
// imitates it in part and stands in for the friction.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/diagnosis/score/internal/scoring.hpp"

namespace shaker::estimator::diagnosis {

struct PairScore {
  std::size_t first = 0, second = 0;  // in Scoring::scores; the first gains more alone
  double gain = 0.0;                  // of both, in chi-squared
};

// The pairs that gain more than either alone, by more than `chance`, with admissible signs. Of two
// kinds of effects the best pair, and the largest gain first. Special cases stand for the richer
// effects that hold them.
std::vector<PairScore> joint_scores(const Scoring& scoring, double chance);

}  // namespace shaker::estimator::diagnosis
