// What is used of a record that is too long to be integrated whole.
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

struct Stretch {
  Eigen::Index begin = 0, length = 0;  // samples
};

// Returns up to three stretches of one length that do not overlap, in their order in time: where the record
// moves most, where about half of it moves more, and where it moves least of what is still a motion. So a
// sweep is seen in and beside its resonance, and a decay from its head to its tail. `share` (below 1) is
// that of the samples which all of them together may have.
std::vector<Stretch> telling_stretches(const Eigen::VectorXd& moves, double share);

}  // namespace shaker::estimator::diagnosis
