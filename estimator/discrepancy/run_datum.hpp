// What is known of one run, ready to be fitted: mean harmonics with their standard errors.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/discrepancy/campaign.hpp"

namespace shaker::estimator::discrepancy {

struct RunDatum {
  std::string name;
  Kind kind = Kind::periodic;
  Role role = Role::fit;
  double frequency_hz = 0.0;
  Eigen::VectorXd driver;    // harmonics of what is imposed
  Eigen::VectorXd response;  // mean harmonics of what is predicted
  Eigen::VectorXd error;     // standard error of each
  Eigen::VectorXd freedom;   // degrees of freedom behind each
  int harmonics() const { return static_cast<int>((response.size() - 1) / 2); }
};

// Root mean square over the cycle of a curve given by its harmonics.
double root_mean_square(const Eigen::VectorXd& harmonics);

}  // namespace shaker::estimator::discrepancy
