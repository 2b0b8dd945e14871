// Cuts a record into whole cycles of its driver, and fits the harmonics of each.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/cycles/internal/phase_fit.hpp"
#include "estimator/diagnosis/cycles/jump_sampling.hpp"

namespace shaker::estimator::diagnosis {

struct WholeCycles {
  std::vector<std::size_t> first, last;  // samples of each: [first, last)
  std::vector<double> start;             // its turn
  double samples = 0.0;                  // in a full cycle

  std::size_t count() const { return first.size(); }
};

WholeCycles whole_cycles(const Recording& run, const PhaseFit& phase);

// A channel and the rows for its harmonics; the number of columns says how many are wanted. All
// harmonics of the run are fitted, so that higher ones do not leak into those that are wanted.
struct CycleChannel {
  const std::vector<double>* samples = nullptr;
  Eigen::MatrixXd* rows = nullptr;
  JumpSampling* sampling = nullptr;  // receives how its jumps are sampled, unless it is null
};

// Fits every cycle that is complete; an incomplete cycle gets no row. Returns the indices of the
// fitted cycles.
std::vector<std::size_t> fit_cycles(const Recording& run, const PhaseFit& phase,
                                    const WholeCycles& cycles, int harmonics,
                                    const std::vector<CycleChannel>& channels);

}  // namespace shaker::estimator::diagnosis
