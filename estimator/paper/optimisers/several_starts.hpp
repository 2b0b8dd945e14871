// A method from several starts. phi has valleys without a good minimum (a damper so stiff that
// nothing moves fits any record with its mean), and a single bad start can end in one.
//
// The starts fill the box with a Sobol sequence, shifted at random by the seed. The scale is
// logarithmic if a parameter is positive and its range spans more than a decade. The range of a
// positive parameter ends at `span` times its start, or at a nearer bound. phi is evaluated in many
// points (one periodic solution each). The method starts from the given start and from the best of
// these points that lie apart.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {

struct StartOptions {
  int starts = 8;        // runs of the method, including the given start
  int looks = 64;        // evaluations of phi for each start
  double span = 1000.0;  // widest range of a positive parameter: factor above and below its start
  std::uint32_t seed = 1;
};

// A point where at least one start ended.
struct Minimum {
  Summary summary;
  int hits = 0;  // starts that ended here
  std::vector<Eigen::VectorXd> from;
};

struct Minima {
  std::vector<Minimum>
      found;  // distinct; converged ones first, each group by increasing sum of squares
  int admissible = 0, looks = 0;
};

// The given start may be inadmissible. `found` is empty when no start was admissible.
Minima several_starts(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                      const Method& method, const Options& options, const StartOptions& starts);

}  // namespace shaker::estimator::optimisers
