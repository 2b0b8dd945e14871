// Numbers of a damper that have a value in each run, as one more run has them.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

// Values of one place of the model file are one number.
struct MeanOfRuns {
  std::vector<ModelNumber> numbers;  // each place once, in the order of the values
  std::vector<double> values;        // one for each number: the mean of its values
  Eigen::MatrixXd weight;            // numbers x values: takes the values to their means
  Eigen::VectorXd scatter;           // variance of a number from run to run; 0: it has one value

  // Of the numbers in one more run, from the covariance of the values.
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& of_values) const;
};

// The means of the values at their places, one for each value. Pure; allocates.
MeanOfRuns mean_of_runs(const std::vector<ModelNumber>& places, const std::vector<double>& values);

}  // namespace shaker::estimator
