// What every method of chapter 4 is given: a nonlinear least-squares problem
//
//     minimise  phi(theta) = 1/2 e^T e,   e = y - yhat(theta),                               (4.1)
//
// with its Jacobian J = d yhat / d theta, so that the gradient is q = -J^T e (4.3) and the Hessian
// H = J^T J + Q with Q = sum over mu of e_mu d2 e_mu / d theta2 (4.4, as corrected: the second sum
// runs over the observations, not over the parameters).
//
// A theta for which there is no answer (1 - theta3 u <= 0, no periodic solution) is *inadmissible*:
// `evaluate` returns false, and a method refuses the step; nobody meets it as infinity or NaN.
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

namespace shaker::estimator::optimise {

class ExtendedProblem;

class LeastSquaresProblem {
 public:
  virtual ~LeastSquaresProblem() = default;
  virtual int parameters() const = 0;    // length of theta
  virtual int observations() const = 0;  // length of e; may be less than parameters()

  // A box; infinite where there is no bound. Methods never ask for a theta outside of it.
  virtual Eigen::VectorXd lower() const {
    return Eigen::VectorXd::Constant(parameters(), -std::numeric_limits<double>::infinity());
  }
  virtual Eigen::VectorXd upper() const {
    return Eigen::VectorXd::Constant(parameters(), std::numeric_limits<double>::infinity());
  }

  // Fills e and, unless null, J. False when theta is inadmissible; the output is then unspecified.
  virtual bool evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                        Eigen::MatrixXd* jacobian) = 0;

  // Exact second derivatives, for problems that have them: Q of (4.4). False when inadmissible.
  virtual bool has_curvature() const { return false; }
  virtual bool curvature(const Eigen::VectorXd& /*theta*/, Eigen::MatrixXd& /*q*/) { return false; }

  // The same problem in 34 digits, for those whose data need it (extended.hpp); usually none.
  virtual const ExtendedProblem* extended() const { return nullptr; }
};

}  // namespace shaker::estimator::optimise
