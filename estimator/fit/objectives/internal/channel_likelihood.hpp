// The likelihood of several channels and its normal equations: (3.15) with V known, (3.13) and
// (3.11) with V eliminated. Private to the sources of channels.hpp.
#pragma once

#include "estimator/fit/objectives/internal/channel_problem.hpp"

namespace shaker::estimator {

class ChannelLikelihood {
 public:
  // `problem` must outlive it. Throws std::invalid_argument if the known covariance has the wrong
  // size or is not positive definite.
  ChannelLikelihood(const ChannelProblem& problem, const ChannelOptions& options);

  bool known() const { return noise_ == NoiseModel::known; }
  bool joint() const { return noise_ == NoiseModel::joint; }
  // V that maximises the likelihood for a given `moment`; the known V if there is one.
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& moment) const;
  // -2 ln(likelihood * prior) without constants. `v` null: V is eliminated.
  double objective(const ChannelLook& look, const std::vector<double>& theta,
                   const Eigen::MatrixXd* v) const;
  // Information matrix J^T V^-1 J and gradient J^T V^-1 e, with priors.
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
