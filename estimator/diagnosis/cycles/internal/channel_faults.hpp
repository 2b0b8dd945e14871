// Faults of a recorded channel that no model can explain: two channels on two clocks, and single
// samples that do not belong to the channel. For a sensor at the end of its range see clipping.hpp.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// Returns the phase shift of the response against the driver in each cycle, in turns, if it is
// constant and the amplitude stays: a damper does not do that, a second clock does. 0: no slip.
// `response`: harmonics, one row for each cycle (steady_cycles.hpp).
double clock_slip(const Eigen::MatrixXd& response);

// Returns single outliers, at most three, the farthest first. Each lies several times farther from
// its neighbours than any other sample does. Therefore it is neither noise, nor a feature that
// returns in each cycle, nor a jump, which its neighbours share.
std::vector<std::size_t> lone_spikes(std::span<const double> y);

}  // namespace shaker::estimator::diagnosis
