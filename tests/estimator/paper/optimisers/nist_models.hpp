// The models of NIST's 27 sets, as printed in the files.
#pragma once

#include <memory>

#include "tests/estimator/paper/optimisers/nist_data.hpp"

namespace shaker::estimator::optimisers::testing {

// The problem of a set; nullptr for an unknown name.
std::unique_ptr<LeastSquaresProblem> nist_problem(const NistSet& set);

}  // namespace shaker::estimator::optimisers::testing
