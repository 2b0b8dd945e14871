// A posterior that is bent: a multivariate t whose stiff directions follow parabolas over the soft
// ones. Private to the sources of posterior.hpp.
//
// Where parameters nearly make up for each other, the posterior is long in one direction and thin
// in others, and even a weakly nonlinear response bends it by many of the thin deviations: the best
// values of the others are a parabola over the long one. An ellipsoid misses its ends, and so does
// a mixture of few of them. So directions are taken one by one, the softest first; each has a mean
// that is a polynomial of second degree in those before it, fitted to draws by weighted least
// squares, and a scatter around that. Such a map has a constant Jacobian, so the density is known
// exactly. With a posterior that is a multivariate t the parabolas vanish but for noise.
#pragma once

#include <random>
#include <vector>

#include <Eigen/Dense>

#include "estimator/worth/posterior_draws.hpp"

namespace shaker::estimator {

// `const` members may be called by several threads at once.
class Bend {
 public:
  // Of draws that `weigh` has seen, their covariance positive definite.
  explicit Bend(const Draws& draws);

  Eigen::VectorXd draw(std::mt19937_64& random) const;
  double density(const Eigen::VectorXd& at) const;  // with its constant

 private:
  void follow(Eigen::Index k, const std::vector<Eigen::VectorXd>& y, const Draws& draws);

  Eigen::VectorXd mean_;
  Eigen::MatrixXd directions_, inverse_;       // to and from directions of unit scatter
  std::vector<Eigen::VectorXd> coefficients_;  // of the polynomial of each direction
  Eigen::VectorXd scatter_;                    // around it
  double volume_ = 1.0;
};

}  // namespace shaker::estimator
