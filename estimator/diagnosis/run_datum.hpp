// What is known of one run, ready to be fitted: mean harmonics and the covariance of their errors;
// of a record that is not periodic its cosines over the record's length (transient_cosines.hpp).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/evaluation_budget.hpp"
#include "estimator/instrument/observation.hpp"

namespace shaker::estimator::diagnosis {

struct SampledRun;

// What one model's prediction on a grid lacks to corners of no width, near one theta
// (smoothing_limit.hpp).
struct ToLimit {
  std::vector<double> theta;
  Eigen::VectorXd value;  // of the harmonics, there
  Eigen::MatrixXd slope;  // harmonics x parameters
  Eigen::VectorXd open;   // of the value: what the extrapolation leaves open
};

struct RunDatum {
  std::string name;
  Kind kind = Kind::periodic;
  Role role = Role::fit;
  double frequency_hz = 0.0;
  Eigen::VectorXd driver;    // harmonics of what is imposed; empty for a sampled run
  Eigen::VectorXd response;  // mean harmonics of what is predicted
  Eigen::VectorXd error;     // standard error of each
  Eigen::VectorXd freedom;   // degrees of freedom behind each
  // Of a run that is not periodic; null for a periodic one.
  std::shared_ptr<const SampledRun> sampled;
  // What is compared of a periodic response, and, where that is not the displacement, the harmonics
  // of the displacement itself (extra_channels.hpp).
  Quantity quantity = Quantity::displacement;
  Eigen::VectorXd motion;
  bool by_force = false;  // forces along the measured motion are compared, not the response
  // L^-1 of the errors' covariance L L': errors of the excitation run through the damper into
  // several harmonics at once. Null: the errors are independent. Shared by copies: a record's is
  // large.
  std::shared_ptr<const Eigen::MatrixXd> whitening;
  // What the response would change by if the time base were off by one standard deviation, the
  // same one for all runs. Empty: it is taken as right.
  Eigen::VectorXd clock;
  // Added to what a grid predicts of this run, of the one model that it was made for. Null:
  // nothing.
  std::shared_ptr<const ToLimit> to_limit;
  // Where solving it counts. Null: nobody asks.
  std::shared_ptr<EvaluationBudget> budget;
  int harmonics() const { return static_cast<int>((response.size() - 1) / 2); }
};

// Of records: all runs of a campaign are, or none.
bool on_samples(const std::vector<RunDatum>& data);
// The first of the data that is seen of the same periodic response as data[k], by another channel;
// k itself where there is none.
std::size_t first_of_response(const std::vector<RunDatum>& data, std::size_t k);

// Sets error and whitening. Throws std::invalid_argument unless it is positive definite.
void set_covariance(RunDatum& datum, const Eigen::MatrixXd& covariance);
Eigen::MatrixXd covariance_of(const RunDatum& datum);
// Columns in units of the noise, and one of them back.
Eigen::MatrixXd whitened(const RunDatum& datum, const Eigen::MatrixXd& columns);
Eigen::VectorXd coloured(const RunDatum& datum, const Eigen::VectorXd& white);
// The covariance's inverse times `left`.
Eigen::VectorXd over_covariance(const RunDatum& datum, const Eigen::VectorXd& left);
// Logarithm of the covariance's determinant, halved.
double log_scale(const RunDatum& datum);

// Root mean square over the cycle of a curve given by its harmonics.
double root_mean_square(const Eigen::VectorXd& harmonics);

}  // namespace shaker::estimator::diagnosis
