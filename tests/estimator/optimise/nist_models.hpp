// The models of NIST's 27 sets, as they are printed in the files.
#pragma once

#include <memory>

#include "tests/estimator/optimise/nist_data.hpp"

namespace shaker::estimator::optimise::testing {

// The problem of a set; nullptr for a name that is not NIST's.
std::unique_ptr<LeastSquaresProblem> nist_problem(const NistSet& set);

}  // namespace shaker::estimator::optimise::testing
