// The extended Kalman filter, the sequential estimation of chapter 3 ("based on the solution of
// some sort of Riccati equation"). It serves as a comparison for information_filter.hpp.
//
// The state theta is a random walk, theta_k = theta_(k-1) + w, w ~ N(0, drift^2). Each cycle is
// one measurement y = yhat(theta) + N(0, s^2 I), linearised once, at the present theta:
//     P <- P + drift^2,   P <- (P^-1 + J^T J / s^2)^-1,   theta <- theta + P J^T e / s^2.
// This is the measurement update in information form. It equals the one with the gain
// P J^T (J P J^T + s^2 I)^-1, but needs no matrix of the size of the cycle.
#pragma once

#include "estimator/online/internal/cycle_predictor.hpp"

namespace shaker::estimator::online {

struct KalmanOptions {
  std::vector<double> first_deviation = {};  // of theta at the start; free parameters, above 0
  std::vector<double> drift = {};  // standard deviation of the change per cycle; empty: none
  double noise = 0.0;              // s of one point, known, above 0
  int grid_points = 128;
};

class ExtendedKalman {
 public:
  // `start`: all parameters. `model` must outlive the filter. Throws std::invalid_argument for
  // lists of the wrong length or noise that is not positive.
  ExtendedKalman(const Model& model, std::vector<double> start, KalmanOptions options);

  // Returns false and changes nothing if the old or the new theta has no periodic solution.
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
