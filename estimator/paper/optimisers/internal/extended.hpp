// Least squares in extended precision (34 digits), for the last steps to a minimum.
//
// Double precision is not sufficient for some data: residuals of 1e-13 of observations of 1 (NIST's
// Lanczos1) have three digits in a double, and a standard deviation computed from them has none.
// Such a problem provides its normal equations in extended precision, as formula_problem.hpp does.
// `polish` makes Newton steps with them from the result of a method in double precision.
#pragma once

#include <string>
#include <vector>

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace shaker::estimator::optimisers {

using Extended = boost::multiprecision::cpp_bin_float_quad;

// The normal equations at one theta with p parameters; matrices row by row.
struct ExtendedProducts {
  Extended sum = 0;                // e^T e
  std::vector<Extended> downhill;  // J^T e
  std::vector<Extended> gram;      // J^T J
  std::vector<Extended> q;         // sum of e d2 e / d theta2
};

class ExtendedProblem {
 public:
  virtual ~ExtendedProblem() = default;
  // Returns false when theta is inadmissible; the output is then unspecified.
  virtual bool products(const std::vector<Extended>& theta, ExtendedProducts& out) const = 0;
};

struct Polished {
  bool converged = false;
  int iterations = 0;
  std::vector<double> theta;
  double sum_of_squares = 0.0;
  std::vector<double> inverse_gram;  // (J^T J)^-1, row by row; multiplied by s^2 it is (3.27)
};

// Iterates Newton's method with J^T J + Q, or Gauss-Newton where that is not positive definite,
// until the relative step is at most 1e-20.
Polished polish(const ExtendedProblem& problem, const std::vector<double>& start);

}  // namespace shaker::estimator::optimisers
