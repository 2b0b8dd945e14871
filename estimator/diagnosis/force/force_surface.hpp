// A smooth force over stroke and velocity, estimated from residuals (remaining_force.hpp).
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// Whitened data, one row for each datum.
struct SurfaceData {
  Eigen::VectorXd residual;
  Eigen::MatrixXd reach;     // of each spline
  Eigen::MatrixXd nuisance;  // what may be explained otherwise, to any amount
};

struct SurfaceFit {
  Eigen::VectorXd mean;  // coefficients
  Eigen::MatrixXd root;  // their covariance is root root'
  double share = 0.0;    // of the residuals' square, nuisances taken out, that it explains
};

// What the priors of all smoothness make of a reach, kept for fits with the same one.
struct SeenPriors {
  Eigen::MatrixXd reach;
  std::vector<Eigen::MatrixXd> seen;  // reach prior reach^T
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
  // `least_noise`) come from the residuals. `known`: of earlier fits of this surface; more are added.
  SurfaceFit fit(const SurfaceData& data, double least_noise, std::vector<SeenPriors>& known) const;

 private:
  Eigen::MatrixXd covariance(double along_stroke, double along_velocity) const;
  SeenPriors seen_by(const Eigen::MatrixXd& reach) const;

  double low_, high_, speed_;
};

}  // namespace shaker::estimator::diagnosis
