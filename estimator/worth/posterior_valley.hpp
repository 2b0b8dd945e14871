// A posterior that lies along a curve: nodes on it, one parameter apart, with the best values of
// the others there and how far they reach. Private to the sources of posterior.hpp.
//
// Where parameters make up for each other over a long way (figure 13: the gas's compactness and
// index), the posterior is a valley, bent, thin and long, that no mixture around its mode follows.
// But given the parameter along it the others are nearly normal. So it is walked as a profile is:
// step by step the others are fitted anew (Newton's method on the logarithm of the density, by
// differences), and the curvature there says how they scatter. The density of that parameter alone
// follows by Laplace's approximation; drawing it first, and the others around the curve with heavy
// tails, gives a proposal for the whole posterior, that knows its own density exactly.
#pragma once

#include <optional>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "estimator/worth/posterior.hpp"

namespace shaker::estimator {

struct ValleyNode {
  double at = 0.0;         // of the parameter along the valley
  Eigen::VectorXd others;  // best there, in their order
  Eigen::MatrixXd root;    // Cholesky's, of their covariance there
  double log_mass = 0.0;   // of all densities there, but for a constant
};

// `const` members may be called by several threads at once.
class Valley {
 public:
  // Two nodes or more, in the order of `at`; linear between them.
  Valley(Eigen::Index along, std::vector<ValleyNode> nodes);

  Eigen::Index along() const { return along_; }
  const std::vector<ValleyNode>& nodes() const { return nodes_; }
  Eigen::VectorXd draw(std::mt19937_64& random) const;
  double density(const Eigen::VectorXd& at) const;  // with its constant

 private:
  struct Centre {
    Eigen::VectorXd others;
    Eigen::MatrixXd root;
  };
  Centre centre(std::size_t left, double share) const;

  Eigen::Index along_;
  std::vector<ValleyNode> nodes_;
  std::vector<double> height_, below_;  // density at each node, probability below it
};

// Both ways from the mode, until next to nothing of the posterior is left or it ends (at a bound).
// Empty where it cannot be followed that far: the best values of the others lie on a bound of
// theirs, or their scatter has no shape.
std::optional<Valley> trace_valley(LogDensity& density, const Eigen::VectorXd& mode,
                                   const Eigen::MatrixXd& covariance, Eigen::Index along);

// Parameters in the order in which they are likely to lead along a valley: how much less they would
// scatter if all others were known.
std::vector<Eigen::Index> likely_valleys(const Eigen::MatrixXd& covariance);

}  // namespace shaker::estimator
