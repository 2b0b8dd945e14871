// A smooth surface over stroke and velocity, estimated from what it does to residuals
// (remaining_force.hpp).
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// Whitened, a row a datum.
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

class ForceSurface {
 public:
  // Over [low, high] x [-speed, speed]; finer about velocity 0, where a part that is smooth over
  // the stroke may jump, as friction does.
  ForceSurface(double low, double high, double speed);

  Eigen::Index size() const;
  // Values at points, a column a spline.
  Eigen::MatrixXd splines(const Eigen::VectorXd& stroke, const Eigen::VectorXd& velocity) const;
  // Smoothness, size and noise (its variance at least `least_noise`) from the residuals themselves.
  SurfaceFit fit(const SurfaceData& data, double least_noise) const;

 private:
  Eigen::MatrixXd covariance(double along_stroke, double along_velocity) const;

  double low_, high_, speed_;
};

}  // namespace shaker::estimator::diagnosis
