// A problem in 34 digits, and the last steps to its minimum in them.
//
// Doubles do not do for some data: residuals of 1e-13 beside observations of 1 (NIST's Lanczos1)
// are three digits of a double, and a standard deviation made from them none. Such a problem offers
// its normal equations in extended precision (formula_problem.hpp does); `polish` takes Newton
// steps in it from where a method in doubles has ended.
#pragma once

#include <string>
#include <vector>

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace shaker::estimator::optimise {

using Extended = boost::multiprecision::cpp_bin_float_quad;

// At one theta, p parameters; matrices row by row.
struct ExtendedProducts {
  Extended sum = 0;                // e^T e
  std::vector<Extended> downhill;  // J^T e
  std::vector<Extended> gram;      // J^T J
  std::vector<Extended> q;         // sum of e d2 e / d theta2
};

class ExtendedProblem {
 public:
  virtual ~ExtendedProblem() = default;
  virtual bool products(const std::vector<Extended>& theta, ExtendedProducts& out) const = 0;
};

struct Polished {
  bool converged = false;
  int iterations = 0;
  std::vector<double> theta;
  double sum_of_squares = 0.0;
  std::vector<double> inverse_gram;  // (J^T J)^-1, row by row: times s^2 it is (3.27)
};

// Newton with (J^T J + Q), Gauss-Newton where that is not definite, until theta stands to 1e-20.
Polished polish(const ExtendedProblem& problem, const std::vector<double>& start);

}  // namespace shaker::estimator::optimise
