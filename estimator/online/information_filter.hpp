// The estimate cycle by cycle in information form, with forgetting.
//
// For every cycle, with e = y - yhat(theta) and J at the point of linearisation,
//     Lambda <- forgetting Lambda + J^T J,    eta <- forgetting eta + J^T e,
//     theta  =  linearisation + Lambda^-1 eta,
// which is the normal equations (4.6) summed up as they come; the covariance is s^2 Lambda^-1
// (3.27). A filter that linearises each cycle once, where it then stood (extended_kalman.hpp),
// never equals the batch answer of a nonlinear model. This one does: with the weighted mean cycle
// of each run, which is sufficient for white noise, Lambda and eta are summed up anew when theta
// has moved by more than `relinearise` of its standard errors from where they were linearised. That
// happens less and less often as theta settles.
//
// With forgetting < 1 a cycle that is k cycles old counts forgetting^k: a memory of 1 / (1 -
// forgetting) cycles. The covariance is then that of a filter which expects drift: wider by
// sqrt(1 + forgetting) than the noise alone would have it.
#pragma once

#include <map>

#include "estimator/online/cycle_predictor.hpp"

namespace shaker::estimator::online {

struct InformationOptions {
  double forgetting = 1.0;    // in (0, 1]
  double relinearise = 0.01;  // standard errors; 0: until theta stands, the batch answer
  int grid_points = 128;
};

class InformationFilter {
 public:
  // Begins at `start` (all parameters) without any information. `model` must outlive it.
  InformationFilter(const Model& model, std::vector<double> start, InformationOptions options);

  // False when no step towards the data has a periodic solution; the cycle still counts.
  bool add(const MeasuredCycle& cycle);

  const std::vector<double>& theta() const { return theta_; }
  Eigen::MatrixXd covariance() const;  // of the free parameters
  double noise() const;                // s of (3.28)
  double weight() const;               // of all cycles: their number when nothing is forgotten
  long linearisations() const { return predictor_.solutions(); }

 private:
  struct RunMean {
    MeasuredCycle mean;
    double weight = 0.0, scatter = 0.0;
  };
  bool sum_up(const std::vector<double>& theta, Eigen::MatrixXd& lambda, Eigen::VectorXd& eta,
              double& squares);
  bool settle();

  const Model* model_;
  InformationOptions options_;
  CyclePredictor predictor_;
  std::map<int, RunMean> runs_;
  std::vector<double> theta_, linearisation_;
  Eigen::MatrixXd lambda_;
  Eigen::VectorXd eta_;
  double squares_ = 0.0;  // weighted e^T e at the point of linearisation, scatter included
};

}  // namespace shaker::estimator::online
