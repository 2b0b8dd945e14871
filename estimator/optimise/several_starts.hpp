// The same problem from several starts: phi has valleys that lead nowhere (a damper so stiff that
// nothing moves fits any record to its mean), and a single bad start ends in one.
//
// Starts fill the box: a Sobol sequence, shifted at random by the seed; logarithmically where a
// parameter is positive and its range spans more than a decade. Where a bound is further than
// `span` times the given start, the range ends there. phi alone is looked at in many points (one
// periodic solution each), and the best of them that lie apart are what the method starts from, the
// given start first.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/optimise/methods.hpp"

namespace shaker::estimator::optimise {

struct StartOptions {
  int starts = 8;        // the method is run so often, the given start included
  int looks = 64;        // for each start, phi in so many points
  double span = 1000.0;  // widest range of a positive parameter, either way from its start
  std::uint32_t seed = 1;
};

// A place where at least one start ended.
struct Minimum {
  Summary summary;
  int hits = 0;  // starts that ended here
  std::vector<Eigen::VectorXd> from;
};

struct Minima {
  std::vector<Minimum>
      found;  // distinct, the smallest sum of squares first; not converged ones last
  int admissible = 0, looks = 0;
};

// An inadmissible given start is no obstacle. Empty `found` when nothing was admissible.
Minima several_starts(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                      const Method& method, const Options& options, const StartOptions& starts);

}  // namespace shaker::estimator::optimise
