// The interface of a nonlinear least-squares problem for the methods of chapter 4:
//
//     minimise  phi(theta) = 1/2 e^T e,   e = y - yhat(theta),                               (4.1)
//
// with the Jacobian J = d yhat / d theta. The gradient is q = -J^T e (4.3) and the Hessian is
// H = J^T J + Q with Q = sum over mu of e_mu d2 e_mu / d theta2 (4.4, as corrected: the second sum
// runs over the observations, not over the parameters).
//
// A theta without a prediction (1 - theta3 u <= 0, no periodic solution) is *inadmissible*:
// `evaluate` returns false, and a method refuses the step.
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

namespace shaker::estimator::optimisers {

class ExtendedProblem;

class LeastSquaresProblem {
 public:
  virtual ~LeastSquaresProblem() = default;
  virtual int parameters() const = 0;    // length of theta
  virtual int observations() const = 0;  // length of e; may be less than parameters()

  // Bounds of theta (the box); infinite where there is none. Methods move theta only inside them.
  virtual Eigen::VectorXd lower() const {
    return Eigen::VectorXd::Constant(parameters(), -std::numeric_limits<double>::infinity());
  }
  virtual Eigen::VectorXd upper() const {
    return Eigen::VectorXd::Constant(parameters(), std::numeric_limits<double>::infinity());
  }

  // Computes e and, unless `jacobian` is null, J (observations x parameters). Returns false when
  // theta is inadmissible; the output is then unspecified.
  virtual bool evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                        Eigen::MatrixXd* jacobian) = 0;

  // Computes Q of (4.4) for problems with second derivatives. Returns false when theta is
  // inadmissible.
  virtual bool has_curvature() const { return false; }
  virtual bool curvature(const Eigen::VectorXd& /*theta*/, Eigen::MatrixXd& /*q*/) { return false; }

  // The same problem in 34 digits, if the data need it (extended.hpp); usually nullptr.
  virtual const ExtendedProblem* extended() const { return nullptr; }
};

}  // namespace shaker::estimator::optimisers
