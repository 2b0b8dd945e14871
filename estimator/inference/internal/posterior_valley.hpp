// A proposal for a posterior along a curve, given by nodes at values of one parameter with the best
// values of the others and their scatter. Private to the sources of posterior.hpp.
//
// Where parameters compensate each other over a long range (figure 13: compactness and polytropic
// index of the gas), the posterior is a curved, thin, long valley that no mixture around its mode
// follows. Given the parameter along the valley, however, the others are nearly normal. Therefore
// the nodes are found as a profile is: step by step the others are fitted again (Newton's method on
// the log density, with finite differences), and the curvature gives their scatter. Laplace's
// approximation gives the density of that parameter alone. A draw takes this parameter first and
// then the others around the curve with heavy tails. The density of the proposal is exact.
#pragma once

#include <optional>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "estimator/inference/posterior.hpp"

namespace shaker::estimator {

struct ValleyNode {
  double at = 0.0;         // value of the parameter along the valley
  Eigen::VectorXd others;  // best values of the others, in their order
  Eigen::MatrixXd root;    // Cholesky factor of their covariance
  double log_mass = 0.0;   // log of the density integrated over the others, without constant
};

// Several threads may call `const` members at the same time.
class Valley {
 public:
  // Two nodes or more, ascending in `at`; linear interpolation between them.
  Valley(Eigen::Index along, std::vector<ValleyNode> nodes);

  Eigen::Index along() const { return along_; }
  const std::vector<ValleyNode>& nodes() const { return nodes_; }
  Eigen::VectorXd draw(std::mt19937_64& random) const;
  double density(const Eigen::VectorXd& at) const;  // normalised

 private:
  struct Centre {
    Eigen::VectorXd others;
    Eigen::MatrixXd root;
  };
  Centre centre(std::size_t left, double share) const;

  Eigen::Index along_;
  std::vector<ValleyNode> nodes_;
  std::vector<double> height_, below_;  // density at each node, cumulative probability
};

// Traces the valley in both directions from the mode until the density is negligible or ends (at a
// bound). Returns nothing where the valley cannot be followed that far: the best values of the
// others lie on a bound, or the density has no maximum over them.
std::optional<Valley> trace_valley(LogDensity& density, const Eigen::VectorXd& mode,
                                   const Eigen::MatrixXd& covariance, Eigen::Index along);

// The parameters, most likely candidates for a valley first: sorted by the ratio of their marginal
// variance to their variance with all others known.
std::vector<Eigen::Index> likely_valleys(const Eigen::MatrixXd& covariance);

}  // namespace shaker::estimator
