// The extended Kalman filter: the sequential estimation of chapter 3 ("based on the solution of
// some sort of Riccati equation"), as the comparison for information_filter.hpp.
//
// State theta, which wanders: theta_k = theta_(k-1) + w, w ~ N(0, drift^2); each cycle is one
// measurement y = yhat(theta) + N(0, s^2 I), linearised once, where the filter stands:
//     P <- P + drift^2,   P <- (P^-1 + J^T J / s^2)^-1,   theta <- theta + P J^T e / s^2,
// the measurement update in information form (the same as the gain P J^T (J P J^T + s^2 I)^-1,
// without a matrix of the size of the cycle).
#pragma once

#include "estimator/online/cycle_predictor.hpp"

namespace shaker::estimator::online {

struct KalmanOptions {
  std::vector<double> first_deviation = {};  // of theta at the start, free parameters
  std::vector<double> drift = {};  // standard deviation of the change per cycle; empty: none
  double noise = 0.0;              // s of a point; known
  int grid_points = 128;
};

class ExtendedKalman {
 public:
  // Throws std::invalid_argument for lists of the wrong length or noise that is not positive.
  ExtendedKalman(const Model& model, std::vector<double> start, KalmanOptions options);

  // False, with nothing changed, when there is no periodic solution at the new theta.
  bool add(const MeasuredCycle& cycle);
  const std::vector<double>& theta() const { return theta_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }

 private:
  const Model* model_;
  KalmanOptions options_;
  CyclePredictor predictor_;
  std::vector<double> theta_;
  Eigen::MatrixXd covariance_;
};

}  // namespace shaker::estimator::online
