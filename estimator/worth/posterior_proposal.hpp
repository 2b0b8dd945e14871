// Where draws of a posterior come from. First a multivariate t around the mode; then, following
// draws, a bent one (posterior_bend.hpp) and, for what has another shape, a mixture of t's around
// some of the draws; always a wide t around the mode, that no round forgets; most of all a valley,
// where one is known. Private to the sources of posterior.hpp. `const` members may be called by
// several threads at once.
#pragma once

#include <memory>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "estimator/worth/posterior_draws.hpp"

namespace shaker::estimator {

class Bend;
class Valley;

// Student's t with few degrees of freedom in so many directions, uncorrelated; and its density
// around `centre` in units of `root` (Cholesky's), with its constant.
Eigen::VectorXd heavy_tailed(Eigen::Index size, std::mt19937_64& random);
double heavy_tailed_density(const Eigen::VectorXd& at, const Eigen::VectorXd& centre,
                            const Eigen::MatrixXd& root);

class Proposal {
 public:
  // Laplace's approximation with heavy tails. `covariance` is positive definite.
  Proposal(const Eigen::VectorXd& mode, const Eigen::MatrixXd& covariance);

  // Follows draws before, that `weigh` has seen. Stays as it is where their covariance is not
  // positive definite.
  void adapt(const Draws& draws);

  // Draws come along the valley from now on, but for a share.
  void follow(std::shared_ptr<const Valley> valley);

  Eigen::VectorXd draw(std::mt19937_64& random) const;
  // ln of the density.
  double log_density(const Eigen::VectorXd& at) const;

 private:
  Eigen::VectorXd mode_;
  Eigen::MatrixXd wide_, narrow_;  // Cholesky's
  std::vector<Eigen::VectorXd> centres_;
  std::shared_ptr<const Bend> bend_;
  std::shared_ptr<const Valley> valley_;
};

}  // namespace shaker::estimator
