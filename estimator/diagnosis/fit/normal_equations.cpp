#include "estimator/diagnosis/fit/internal/normal_equations.hpp"

#include "estimator/diagnosis/fit/internal/predicted_runs.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// What the prior of a free parameter says at theta: (mean - value) / sigma, and 1 / sigma; zeros
// where it has none. One more datum each (3.8).
struct PriorPull {
  double off = 0.0, weight = 0.0;
};

PriorPull prior_pull(const HarmonicFit& fit, const std::vector<double>& theta, Index k) {
  const auto parameter = static_cast<std::size_t>(fit.free[static_cast<std::size_t>(k)]);
  const ModelParameter& p = fit.model->parameters()[parameter];
  if (!p.prior_mean) return {};
  const double weight = 1.0 / *p.prior_standard_deviation;
  return {(*p.prior_mean - theta[parameter]) * weight, weight};
}

}  // namespace

NormalEquations normal_equations(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                 const std::vector<double>& theta) {
  const auto q = static_cast<Index>(fit.free.size());
  NormalEquations n{MatrixXd::Zero(q, q), VectorXd::Zero(q), 0.0, {}, VectorXd::Zero(q)};
  double misfit = 0.0, size = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!is_fitted(data[r])) continue;
    const VectorXd e = whitened_residual(fit, data, r);
    n.jacobian.push_back(whitened_jacobian(fit, data, r, fit.free));
    const MatrixXd& j = n.jacobian.back();
    n.gram += j.transpose() * j;
    n.gradient += j.transpose() * e;
    n.chi_squared += e.squaredNorm();
    if (data[r].clock.size() == 0) continue;
    const VectorXd k = whitened(data[r], data[r].clock);
    n.with_clock += j.transpose() * k;
    misfit += k.dot(e);
    size += k.squaredNorm();
  }
  // The time base is off by a normal variate: that is one more column with a prior, eliminated.
  n.gram -= n.with_clock * n.with_clock.transpose() / (1.0 + size);
  n.gradient -= n.with_clock * (misfit / (1.0 + size));
  n.chi_squared -= misfit * misfit / (1.0 + size);
  for (Index k = 0; k < q; ++k) {
    const PriorPull prior = prior_pull(fit, theta, k);
    n.gram(k, k) += prior.weight * prior.weight;
    n.gradient[k] += prior.weight * prior.off;
    n.chi_squared += prior.off * prior.off;
  }
  return n;
}

VectorXd gradient_by(const NormalEquations& before, const HarmonicFit& fit,
                     const std::vector<RunDatum>& data, const std::vector<double>& theta) {
  VectorXd gradient = VectorXd::Zero(before.gradient.size());
  double misfit = 0.0, size = 0.0;
  auto j = before.jacobian.begin();
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!is_fitted(data[r])) continue;
    const VectorXd e = whitened_residual(fit, data, r);
    gradient += (j++)->transpose() * e;
    if (data[r].clock.size() == 0) continue;
    const VectorXd k = whitened(data[r], data[r].clock);
    misfit += k.dot(e);
    size += k.squaredNorm();
  }
  gradient -= before.with_clock * (misfit / (1.0 + size));
  for (Index k = 0; k < gradient.size(); ++k) {
    const PriorPull prior = prior_pull(fit, theta, k);
    gradient[k] += prior.weight * prior.off;
  }
  return gradient;
}

}  // namespace shaker::estimator::diagnosis
