// The data of one run for the fit: mean harmonics and the covariance of their errors. For a record
// without a period: its cosines over the length of the record (transient_cosines.hpp).
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/internal/evaluation_budget.hpp"
#include "estimator/model/instrument/observation.hpp"

namespace shaker::estimator::diagnosis {

struct SampledRun;

// The difference between a prediction on a grid and the limit of zero smoothing width, for one
// model near one theta (smoothing_limit.hpp).
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
  // What all runs of the campaign state; run and group where the model has values of their own for
  // them (inputs.hpp), otherwise empty.
  config::RunCondition condition;
  Eigen::VectorXd driver;    // harmonics of what is imposed; empty for a sampled run
  Eigen::VectorXd response;  // mean harmonics of what is predicted
  Eigen::VectorXd error;     // standard error of each
  Eigen::VectorXd freedom;   // degrees of freedom behind each
  // The record of a run without a period; null for a periodic run.
  std::shared_ptr<const SampledRun> sampled;
  // The quantity of a periodic response that is compared; if it is not the displacement, `motion`
  // has the harmonics of the displacement (extra_channels.hpp).
  Quantity quantity = Quantity::displacement;
  Eigen::VectorXd motion;
  // Standard deviation over the runs of the part of the mean that differs from run to run (the
  // sensor's zero, the preload). It is included in error[0], and no gap counts that mean. 0: the
  // runs do not differ.
  double own_zero = 0.0;
  bool by_force = false;  // forces along the measured motion are compared, not the response
  // L^-1 of the covariance L L' of the errors: an error of the excitation runs through the damper
  // into several harmonics at once. Null: the errors are independent. Copies share it, because that
  // of a record is large.
  std::shared_ptr<const Eigen::MatrixXd> whitening;
  // Change of the response for an error of the time base of one standard deviation, which is the
  // same for all runs. Empty: the time base is taken as right.
  Eigen::VectorXd clock;
  // Added to the prediction on a grid, for the one model that it was made for. Null: nothing.
  std::shared_ptr<const ToLimit> to_limit;
  // The evaluation budget that pays for its solutions. Null: no limit.
  std::shared_ptr<EvaluationBudget> budget;
  int harmonics() const { return static_cast<int>((response.size() - 1) / 2); }
};

// True if the runs are records without a period. All runs of a campaign are, or none is.
bool on_samples(const std::vector<RunDatum>& data);
// Index of the first datum from the same periodic response as data[k]; k itself if there is none
// before it.
std::size_t first_of_response(const std::vector<RunDatum>& data, std::size_t k);

// Sets error and whitening. Throws std::invalid_argument unless it is positive definite.
void set_covariance(RunDatum& datum, const Eigen::MatrixXd& covariance);
Eigen::MatrixXd covariance_of(const RunDatum& datum);
// Columns in units of the noise, and the inverse.
Eigen::MatrixXd whitened(const RunDatum& datum, const Eigen::MatrixXd& columns);
Eigen::MatrixXd coloured(const RunDatum& datum, const Eigen::MatrixXd& white);
// The covariance's inverse times `left`.
Eigen::VectorXd over_covariance(const RunDatum& datum, const Eigen::VectorXd& left);
// Half the logarithm of the covariance's determinant.
double log_scale(const RunDatum& datum);

// Returns the harmonics without their mean if the run has an own zero, otherwise as they are.
Eigen::VectorXd without_own_zero(const RunDatum& datum, Eigen::VectorXd harmonics);

// Root mean square over the cycle of a curve given by its harmonics.
double root_mean_square(const Eigen::VectorXd& harmonics);

}  // namespace shaker::estimator::diagnosis
