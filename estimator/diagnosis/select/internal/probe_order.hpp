// The order in which effects are tried beside a hypothesis.
#pragma once

#include <vector>

#include "estimator/diagnosis/score/internal/candidates.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"

namespace shaker::estimator::diagnosis {

constexpr double kMinRefitGain = 5.0;  // of chi-squared: less is chance

struct OrderedProbe {
  const Candidate* candidate;
  const Probe* probe;
  double gain;  // of chi-squared, by the score
};

// The best shape of each candidate that gains more than chance does, with the best candidate first.
std::vector<OrderedProbe> ordered(const Scoring& scoring);

// Puts effects with a memory last. Their fits are the dearest: they are given up sooner once it is
// known how little others leave.
void put_memory_last(std::vector<OrderedProbe>& probes);

}  // namespace shaker::estimator::diagnosis
