// Proposal distribution for a posterior. The first one is a multivariate t around the mode.
// After `adapt` it is a curved t (posterior_bend.hpp) and a mixture of t's around some of the
// draws, for other shapes. A wide t around the mode always remains. If a valley is known, most
// draws follow it. Private to the sources of posterior.hpp. Several threads may call `const`
// members at the same time.
#pragma once

#include <memory>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "estimator/inference/internal/posterior_draws.hpp"

namespace shaker::estimator {

class Bend;
class Valley;

// A draw of an uncorrelated Student's t with 5 degrees of freedom in `size` directions; and the
// normalised density of that t around `centre`, scaled by the Cholesky factor `root`.
Eigen::VectorXd heavy_tailed(Eigen::Index size, std::mt19937_64& random);
double heavy_tailed_density(const Eigen::VectorXd& at, const Eigen::VectorXd& centre,
                            const Eigen::MatrixXd& root);

class Proposal {
 public:
  // Laplace's approximation with heavy tails. `covariance` is positive definite.
  Proposal(const Eigen::VectorXd& mode, const Eigen::MatrixXd& covariance);

  // Fits the proposal to draws that have passed through `weigh`. Changes nothing where their
  // covariance is not positive definite.
  void adapt(const Draws& draws);

  // From now on 80 % of the draws follow the valley; null: none.
  void follow(std::shared_ptr<const Valley> valley);

  Eigen::VectorXd draw(std::mt19937_64& random) const;
  // Logarithm of the normalised density.
  double log_density(const Eigen::VectorXd& at) const;

 private:
  Eigen::VectorXd mode_;
  Eigen::MatrixXd wide_, narrow_;  // Cholesky factors
  std::vector<Eigen::VectorXd> centres_;
  std::shared_ptr<const Bend> bend_;
  std::shared_ptr<const Valley> valley_;
};

}  // namespace shaker::estimator
