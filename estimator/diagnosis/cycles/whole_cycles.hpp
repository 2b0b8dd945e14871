// A record's samples in whole cycles of what drives it, and the harmonics of each.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/cycles/phase_fit.hpp"

namespace shaker::estimator::diagnosis {

struct WholeCycles {
  std::vector<std::size_t> first, last;  // samples of each: [first, last)
  std::vector<double> start;             // its turn
  double samples = 0.0;                  // in a full cycle

  std::size_t count() const { return first.size(); }
};

WholeCycles whole_cycles(const Recording& run, const PhaseFit& phase);

// A channel, and the rows that its harmonics go to: as many columns as there are numbers wanted.
// All of the run's harmonics are fitted: what lies above those that are wanted must not leak into
// them.
struct CycleChannel {
  const std::vector<double>* samples = nullptr;
  Eigen::MatrixXd* rows = nullptr;
};

// Fits every cycle that has its samples; cycles that lack some leave no row. Returns the places of
// those that were fitted among `cycles`.
std::vector<std::size_t> fit_cycles(const Recording& run, const PhaseFit& phase,
                                    const WholeCycles& cycles, int harmonics,
                                    const std::vector<CycleChannel>& channels);

}  // namespace shaker::estimator::diagnosis
