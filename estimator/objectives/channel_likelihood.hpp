// The likelihood of several channels: (3.15) with V known, (3.13) and (3.11) with V eliminated, and
// their normal equations. Private to the sources of channels.hpp.
#pragma once

#include "estimator/objectives/channel_problem.hpp"

namespace shaker::estimator {

class ChannelLikelihood {
 public:
  // Throws std::invalid_argument for a known covariance that is none.
  ChannelLikelihood(const ChannelProblem& problem, const ChannelOptions& options);

  bool known() const { return noise_ == NoiseModel::known; }
  bool joint() const { return noise_ == NoiseModel::joint; }
  // V that maximises the likelihood, theta given; the known one where it is.
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& moment) const;
  // -2 ln of likelihood and prior without constants; `v` null: with V eliminated.
  double objective(const ChannelLook& look, const std::vector<double>& theta,
                   const Eigen::MatrixXd* v) const;
  // Information J^T V^-1 J and gradient J^T V^-1 e, priors included.
  void normal_equations(const ChannelLook& look, const std::vector<double>& theta,
                        const Eigen::MatrixXd& v, Eigen::MatrixXd& gram,
                        Eigen::VectorXd& gradient) const;

 private:
  double prior_sum(const std::vector<double>& theta) const;

  const ChannelProblem& problem_;
  NoiseModel noise_;
  Eigen::MatrixXd known_;
};

}  // namespace shaker::estimator
