// What a recorded channel shows of itself that no model can explain: a sensor at the end of its
// range, two channels on two clocks, and a sample that is not the channel's.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::discrepancy {

// A curve that stays on its extreme value three times as long as its quantisation explains, again
// and again, has met the end of the sensor's range. So has one that stays there for a few samples
// of most cycles and comes to it with a slope, which would have carried it on by more than a step
// of its grid. `top`: the highest value, else the lowest. `quantum`: step of the grid that the
// values stand on; 0: not known.
bool clipped(std::span<const double> y, double samples_a_cycle, double cycles, bool top,
             double quantum = 0.0);

// By how many turns the response slips against what drives it with every cycle, when it does so
// evenly and keeps its amplitude: no damper does that, a second clock does. 0: it does not.
// `response`: harmonics, a row a cycle (steady_cycles.hpp).
double clock_slip(const Eigen::MatrixXd& response);

// Single samples, at most three, far from what their neighbours say: several times as far as any
// other, and so neither noise nor what comes back with every cycle; nor a jump, which its
// neighbours share. The farthest first.
std::vector<std::size_t> lone_spikes(std::span<const double> y);

}  // namespace shaker::estimator::discrepancy
