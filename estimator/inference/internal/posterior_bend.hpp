// A proposal for a curved posterior: a multivariate t whose stiff directions follow parabolas over
// the soft ones. Private to the sources of posterior.hpp.
//
// Where parameters nearly compensate each other, the posterior is long in one direction and thin in
// the others. Even a weakly nonlinear response then bends it by many of the thin standard
// deviations: the best values of the other parameters are a parabola over the long direction. An
// ellipsoid misses the ends, and so does a mixture of few ellipsoids. This class treats the
// directions one by one, the softest first. The mean of each is a polynomial of second degree in
// those before it, fitted to draws by weighted least squares, with a scatter around it. The map has
// a constant Jacobian, so the density is exact. If the posterior is a multivariate t, the fitted
// parabolas vanish up to noise.
#pragma once

#include <random>
#include <vector>

#include <Eigen/Dense>

#include "estimator/inference/internal/posterior_draws.hpp"

namespace shaker::estimator {

// Several threads may call `const` members at the same time.
class Bend {
 public:
  // Fits the draws, which have passed through `weigh` and have a positive definite covariance.
  explicit Bend(const Draws& draws);

  Eigen::VectorXd draw(std::mt19937_64& random) const;
  double density(const Eigen::VectorXd& at) const;  // normalised

 private:
  void follow(Eigen::Index k, const std::vector<Eigen::VectorXd>& y, const Draws& draws);

  Eigen::VectorXd mean_;
  Eigen::MatrixXd directions_, inverse_;       // to and from coordinates of unit scatter
  std::vector<Eigen::VectorXd> coefficients_;  // of each direction's polynomial
  Eigen::VectorXd scatter_;                    // around the polynomial
  double volume_ = 1.0;
};

}  // namespace shaker::estimator
