// Scaling for library methods whose steps depend on units: parameters in units of their start
// values, phi in units of its start value. Internal to the folder.
#pragma once

#include "estimator/paper/optimisers/internal/evaluator.hpp"

namespace shaker::estimator::optimisers {

class Scaled {
 public:
  Scaled(Evaluator& evaluator, const Point& start)
      : evaluator_(evaluator),
        unit_(start.theta.cwiseAbs()),
        phi_unit_(start.phi > 0.0 ? start.phi : 1.0) {
    for (Eigen::Index k = 0; k < unit_.size(); ++k)
      unit_[k] = unit_[k] > 0.0 ? unit_[k] : 1.0;
    best_ = start;
  }

  Eigen::VectorXd to(const Eigen::VectorXd& theta) const { return theta.cwiseQuotient(unit_); }
  Eigen::VectorXd from(const Eigen::VectorXd& x) const { return x.cwiseProduct(unit_); }
  const Eigen::VectorXd& unit() const { return unit_; }
  double phi_unit() const { return phi_unit_; }

  // Evaluates at x. A theta outside the box is refused and not moved, because the library must get
  // the function at the point that it requested.
  bool at(const double* x, bool with_jacobian) {
    const Eigen::VectorXd theta = from(Eigen::Map<const Eigen::VectorXd>(x, unit_.size()));
    if (!theta.allFinite() || evaluator_.exhausted()) return false;
    const Eigen::VectorXd inside = evaluator_.into_box(theta);
    if (((inside - theta).cwiseAbs().array() > 1e-14 * unit_.array()).any()) {
      ++evaluator_.summary().refused;
      return false;
    }
    here_.theta = inside;
    if (!evaluator_.at(here_, with_jacobian)) return false;
    if (here_.phi < best_.phi) best_ = here_;
    return true;
  }
  const Point& here() const { return here_; }
  const Point& best() const { return best_; }
  // Gradient of phi / phi_unit over x.
  Eigen::VectorXd gradient() const {
    return -(here_.jacobian.transpose() * here_.e).cwiseProduct(unit_) / phi_unit_;
  }
  Evaluator& evaluator() { return evaluator_; }

 private:
  Evaluator& evaluator_;
  Eigen::VectorXd unit_;
  double phi_unit_;
  Point here_, best_;
};

// Sets the status of a library's result by the criteria of our own methods, or by the gradient.
// First- and zeroth-order methods resolve phi to rounding, and theta to the square root of that, so
// the tolerances are the square roots.
Summary judge(const char* method, Scaled& scaled, bool gave_up);

}  // namespace shaker::estimator::optimisers
