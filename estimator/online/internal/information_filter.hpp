// Sequential estimation in information form, cycle by cycle, with forgetting.
//
// For every cycle, with e = y - yhat(theta) and J at the point of linearisation,
//     Lambda <- forgetting Lambda + J^T J,    eta <- forgetting eta + J^T e,
//     theta  =  linearisation + Lambda^-1 eta.
// These are the normal equations (4.6), summed as the cycles arrive. The covariance is
// s^2 Lambda^-1 (3.27). A filter that linearises each cycle once (extended_kalman.hpp) never equals
// the batch estimate of a nonlinear model. This filter does: it sums Lambda and eta again when
// theta has moved by more than `relinearise` standard errors from the point of linearisation.
// For that it keeps the weighted mean cycle of each run, which is sufficient for white noise.
// Linearising again becomes rarer as theta settles.
//
// With forgetting < 1 a cycle that is k cycles old has the weight forgetting^k, which gives a
// memory of 1 / (1 - forgetting) cycles. The covariance is then that of a filter which expects
// drift: its standard errors are larger by sqrt(1 + forgetting) than the noise alone causes.
#pragma once

#include <map>

#include "estimator/online/internal/cycle_predictor.hpp"

namespace shaker::estimator::online {

struct InformationOptions {
  double forgetting = 1.0;    // in (0, 1]
  double relinearise = 0.01;  // standard errors; 0: until theta stands still (batch estimate)
  int grid_points = 128;
};

class InformationFilter {
 public:
  // Starts at `start` (all parameters) without information. `model` must outlive the filter.
  // Throws std::invalid_argument for a forgetting factor outside (0, 1].
  InformationFilter(const Model& model, std::vector<double> start, InformationOptions options);

  // Adds a cycle. Returns false if theta did not settle, for example because no step towards the
  // data has a periodic solution; the cycle counts nevertheless.
  bool add(const MeasuredCycle& cycle);

  const std::vector<double>& theta() const { return theta_; }
  Eigen::MatrixXd covariance() const;  // free x free parameters
  double noise() const;                // s of (3.28); NaN without degrees of freedom
  double weight() const;               // sum over all cycles; their number without forgetting
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
  double squares_ = 0.0;  // weighted e^T e at the point of linearisation, plus the scatter
};

}  // namespace shaker::estimator::online
