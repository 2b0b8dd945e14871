// A smooth force over stroke and velocity, estimated from residuals (remaining_force.hpp).
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {

// Whitened data, one row for each datum.
struct SurfaceData {
  Eigen::VectorXd residual;
  Eigen::MatrixXd reach;     // of each spline
  Eigen::MatrixXd nuisance;  // what may be explained otherwise, to any amount
};

struct SurfaceFit {
  Eigen::VectorXd mean;    // coefficients
  Eigen::MatrixXd spread;  // their covariance is spread^T spread
  double share = 0.0;      // of the residuals' square, nuisances taken out, that it explains
};

// The data's variance by a prior of one smoothness, over its largest.
struct SeenPrior {
  double along_stroke = 0.0, along_velocity = 0.0;
  double largest = 1.0;
  Tridiagonal seen;
  // Of a prior that was once the likeliest: l of its covariance l l', what the data see of it, and
  // the products of that. Empty: not yet.
  Eigen::MatrixXd root, through, gram;
};

// What the priors of all smoothness make of a reach, kept for the next fit with the same one.
struct SeenPriors {
  Eigen::MatrixXd reach;
  std::optional<TallQr> reached;  // the directions of the data that it reaches; none: all
  Eigen::MatrixXd inside;         // the reach in these directions
  std::vector<SeenPrior> priors;
  int points = 0;  // of a cycle of an imposed motion: all fits are read on one grid; 0: none yet
};

class ForceSurface {
 public:
  // The surface covers [low, high] x [-speed, speed]. It is finer about zero velocity, where the
  // force may jump as friction does.
  ForceSurface(double low, double high, double speed);

  Eigen::Index size() const;
  // Values of the splines at points, one column for each spline.
  Eigen::MatrixXd splines(const Eigen::VectorXd& stroke, const Eigen::VectorXd& velocity) const;
  // Fits the surface. Its smoothness and size and the noise (of a variance of at least
  // `least_noise`) come from the residuals. `known`: of the last fit of this surface, or empty.
  SurfaceFit fit(const SurfaceData& data, double least_noise, SeenPriors& known) const;

 private:
  Eigen::MatrixXd covariance(double along_stroke, double along_velocity) const;
  SeenPriors seen_by(const Eigen::MatrixXd& reach) const;

  double low_, high_, speed_;
};

}  // namespace shaker::estimator::diagnosis
