#include "estimator/fit/objectives/internal/channel_likelihood.hpp"

#include <cmath>
#include <stdexcept>

#include "estimator/math/dense.hpp"

namespace shaker::estimator {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

ChannelLikelihood::ChannelLikelihood(const ChannelProblem& problem, const ChannelOptions& options)
    : problem_(problem), noise_(options.noise) {
  if (!known()) return;
  const Index m = problem.channels();
  if (options.known_covariance.size() != static_cast<std::size_t>(m * m))
    throw std::invalid_argument(
        "weighted least squares need the covariance of the channels' noise");
  known_ = Eigen::Map<const MatrixXd>(options.known_covariance.data(), m, m);
  if (!Cholesky(known_).positive())
    throw std::invalid_argument("the covariance of the channels' noise is not positive definite");
}

MatrixXd ChannelLikelihood::covariance(const MatrixXd& moment) const {
  if (known()) return known_;
  MatrixXd v = moment / problem_.points();
  if (noise_ == NoiseModel::independent) v = VectorXd(v.diagonal()).asDiagonal();
  // Exact data have zero residuals. A share of the signal far below rounding keeps V invertible.
  v.diagonal() += 1e-26 * problem_.spread_of_data().diagonal();
  return v;
}

double ChannelLikelihood::prior_sum(const std::vector<double>& theta) const {
  double sum = 0.0;
  for (Index k = 0; k < problem_.parameters(); ++k) {
    const ModelParameter& p = problem_.parameter(k);
    if (!p.prior_mean) continue;
    const double off = (theta[problem_.index(k)] - *p.prior_mean) / *p.prior_standard_deviation;
    sum += off * off;
  }
  return sum;
}

double ChannelLikelihood::objective(const ChannelLook& look, const std::vector<double>& theta,
                                    const MatrixXd* v) const {
  const double prior = prior_sum(theta);
  if (v != nullptr) return Cholesky(*v).solve(look.moment).trace() + prior;
  const MatrixXd l = Cholesky(covariance(look.moment)).root();
  return 2.0 * problem_.points() * l.diagonal().array().log().sum() + prior;
}

void ChannelLikelihood::normal_equations(const ChannelLook& look, const std::vector<double>& theta,
                                         const MatrixXd& v, MatrixXd& gram,
                                         VectorXd& gradient) const {
  const Index q = problem_.parameters(), m = problem_.channels();
  gram.setZero(q, q);
  gradient.setZero(q);
  const Cholesky factor(v);
  for (std::size_t r = 0; r < look.e.size(); ++r) {
    for (Index i = 0; i < look.e[r].rows(); ++i) {
      const MatrixXd rows = factor.whiten(MatrixXd(look.j[r].middleRows(i * m, m)));
      const VectorXd e = factor.whiten(VectorXd(look.e[r].row(i).transpose()));
      gram += rows.transpose() * rows;
      gradient += rows.transpose() * e;
    }
  }
  for (Index k = 0; k < q; ++k) {
    const ModelParameter& p = problem_.parameter(k);
    if (!p.prior_mean) continue;
    const double weight = 1.0 / (*p.prior_standard_deviation * *p.prior_standard_deviation);
    gram(k, k) += weight;
    gradient[k] += weight * (*p.prior_mean - theta[problem_.index(k)]);
  }
}

}  // namespace shaker::estimator
