// What a recorded channel shows of itself that no model can explain: two channels on two clocks,
// and a sample that is not the channel's. A sensor at the end of its range: clipping.hpp.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// By how many turns the response slips against what drives it with every cycle, when it does so
// evenly and keeps its amplitude: no damper does that, a second clock does. 0: it does not.
// `response`: harmonics, a row a cycle (steady_cycles.hpp).
double clock_slip(const Eigen::MatrixXd& response);

// Single samples, at most three, far from what their neighbours say: several times as far as any
// other, and so neither noise nor what comes back with every cycle; nor a jump, which its
// neighbours share. The farthest first.
std::vector<std::size_t> lone_spikes(std::span<const double> y);

}  // namespace shaker::estimator::diagnosis
