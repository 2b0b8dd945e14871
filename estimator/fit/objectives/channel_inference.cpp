#include "estimator/fit/objectives/internal/channel_inference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSmallestEigenvalue = 1e-14;  // of the information, relative to the largest
constexpr double kInvolved = 1e-3;  // component above which a parameter is part of a direction

// Degrees of freedom that each channel spends on parameters: the trace of its own part of the
// information times the inverse of the whole.
VectorXd spent_on_parameters(const ChannelProblem& problem, const ChannelLook& look,
                             const MatrixXd& v, const MatrixXd& inverse) {
  const Index m = problem.channels();
  VectorXd spent = VectorXd::Zero(m);
  const MatrixXd weight = v.inverse();
  for (std::size_t r = 0; r < look.e.size(); ++r) {
    for (Index i = 0; i < look.e[r].rows(); ++i) {
      const MatrixXd rows = look.j[r].middleRows(i * m, m);
      spent += (rows * inverse * rows.transpose() * weight).diagonal();
    }
  }
  return spent;
}

// Correction for an estimated V, whose errors make the weights suboptimal and the covariance too
// small. Let p_b be the share of channel b in the information and nu_b its degrees of freedom. The
// factor is 1 + 4 sum p_b (1 - p_b) / nu_b (Meier 1953, for means of unequal variance). If the
// covariances between m channels are estimated too, it is multiplied by (nu - 2) / (nu - m - 1),
// the bias of an inverted Wishart matrix beyond that of its diagonal. Both are 1 for one channel.
// Degrees of freedom of the whole: 1 / sum(p_b^2 / nu_b) (Satterthwaite 1946).
struct Uncertainty {
  double factor = 1.0, degrees = 0.0;
};

Uncertainty of_estimated_noise(const VectorXd& spent, double points, bool joint) {
  const double all = std::max(spent.sum(), 1e-300);
  const double nu = points - spent.mean();
  Uncertainty out;
  double inverse_degrees = 0.0;
  for (const double own : spent) {
    const double share = std::clamp(own / all, 0.0, 1.0);
    const double degrees = std::max(points - own, 1.0);
    out.factor += 4.0 * share * (1.0 - share) / degrees;
    inverse_degrees += share * share / degrees;
  }
  const double others = nu - static_cast<double>(spent.size()) - 1.0;
  if (joint && others > 0.0) out.factor *= (nu - 2.0) / others;
  out.degrees = 1.0 / std::max(inverse_degrees, 1e-300);
  return out;
}

// Returns the pseudo-inverse of the information, so that undetermined directions do not affect the
// variances of determined parameters. Marks undetermined parameters in `fit`.
MatrixXd invert(const ChannelProblem& problem, const MatrixXd& gram, Fit& fit) {
  const VectorXd root = gram.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd scale = (root.array() > 0.0).select(root, 1.0);
  const MatrixXd unit =
      scale.cwiseInverse().asDiagonal() * gram * scale.cwiseInverse().asDiagonal();
  const Spectrum eigen = spectrum_of(unit);
  const VectorXd& values = eigen.values;
  const double largest = values[values.size() - 1];
  fit.condition = std::sqrt(largest / std::max(values[0], 1e-300));
  fit.lost.clear();
  MatrixXd inverse = MatrixXd::Zero(unit.rows(), unit.cols());
  for (Index i = 0; i < values.size(); ++i) {
    const VectorXd direction = eigen.vectors.col(i);
    if (values[i] > kSmallestEigenvalue * largest) {
      inverse += direction * direction.transpose() / values[i];
      continue;
    }
    std::vector<double> lost(fit.theta.size(), 0.0);
    for (Index k = 0; k < values.size(); ++k) {
      if (std::fabs(direction[k]) <= kInvolved) continue;
      const std::size_t all = problem.index(k);
      fit.determined[all] = 0;
      lost[all] = direction[k] / scale[k];
    }
    fit.lost.push_back(std::move(lost));
    fit.status = FitStatus::undetermined;
  }
  return scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
}

// Covariance from the error of the excitation. It changes all points of all channels together (S),
// and theta by H^-1 J^T V^-1 S. Its independent parts are added, as in fit_inference_covariance.cpp.
MatrixXd excitation_part(ChannelProblem& problem, const ChannelLook& look,
                         const std::vector<double>& theta, const MatrixXd& v,
                         const MatrixXd& inverse) {
  const Index m = problem.channels();
  MatrixXd sum = MatrixXd::Zero(inverse.rows(), inverse.cols());
  const MatrixXd weight = v.inverse();
  for (std::size_t r = 0; r < look.e.size(); ++r) {
    const MatrixXd moved = problem.moved_by_excitation(r, theta);
    if (moved.size() == 0) continue;
    MatrixXd product = MatrixXd::Zero(inverse.rows(), moved.cols());
    for (Index i = 0; i < look.e[r].rows(); ++i)
      product += look.j[r].middleRows(i * m, m).transpose() * weight * moved.middleRows(i * m, m);
    const MatrixXd shift = inverse * product;
    sum += shift * shift.transpose();
  }
  return sum;
}

}  // namespace

void finish_without_solution(const ChannelProblem& problem, Fit& fit) {
  const std::size_t p = fit.theta.size();
  const auto q = static_cast<std::size_t>(problem.parameters());
  fit.standard_error.assign(p, 0.0);
  fit.at_bound.assign(p, 0);
  fit.determined.assign(p, 1);
  fit.covariance.assign(q * q, kNaN);
  fit.lack_of_fit = fit.quantile = kNaN;
  for (Index k = 0; k < problem.parameters(); ++k) {
    const ModelParameter& parameter = problem.parameter(k);
    const double theta = fit.theta[problem.index(k)];
    fit.at_bound[problem.index(k)] = theta <= parameter.lower || theta >= parameter.upper;
  }
}

void finish(ChannelProblem& problem, const ChannelLikelihood& likelihood, const ChannelLook& look,
            double confidence, ChannelFit& out) {
  Fit& fit = out.fit;
  finish_without_solution(problem, fit);
  const MatrixXd v = likelihood.covariance(look.moment);
  const Cholesky factor(v);
  const MatrixXd l = factor.root();
  const double points = problem.points(), samples = points * static_cast<double>(v.rows());
  out.log_likelihood =
      -0.5 * (samples * std::log(2.0 * std::numbers::pi) +
              2.0 * points * l.diagonal().array().log().sum() + factor.solve(look.moment).trace());
  out.likely_covariance.assign(v.data(), v.data() + v.size());
  out.noise_covariance = out.likely_covariance;
  fit.sum_of_squares = look.moment(0, 0);
  fit.noise = std::sqrt(v(0, 0));
  const Index q = problem.parameters();
  if (likelihood.known() && fit.degrees_of_freedom > 0)
    fit.lack_of_fit = chi_squared_above(factor.solve(look.moment).trace(),
                                        static_cast<double>(fit.degrees_of_freedom));
  if (q == 0) return;
  MatrixXd gram, better = v;
  VectorXd gradient;
  likelihood.normal_equations(look, fit.theta, v, gram, gradient);
  MatrixXd inverse = invert(problem, gram, fit);
  fit.interval_degrees = std::numeric_limits<double>::infinity();
  if (!likelihood.known()) {
    // The variance of each channel is corrected for the degrees of freedom that it spends.
    const VectorXd spent = spent_on_parameters(problem, look, v, inverse);
    const VectorXd grow = (points / (points - spent.array()).max(1e-9)).sqrt().matrix();
    better = grow.asDiagonal() * v * grow.asDiagonal();
    out.noise_covariance.assign(better.data(), better.data() + better.size());
    fit.noise = std::sqrt(better(0, 0));
    likelihood.normal_equations(look, fit.theta, better, gram, gradient);
    inverse = invert(problem, gram, fit);
    const Uncertainty more = of_estimated_noise(spent, points, likelihood.joint());
    inverse *= more.factor;
    fit.interval_degrees = more.degrees;
  }
  fit.quantile = student_t_quantile(0.5 + 0.5 * confidence, fit.interval_degrees);
  inverse += excitation_part(problem, look, fit.theta, better, inverse);
  for (Index k = 0; k < q; ++k) {
    if (fit.determined[problem.index(k)]) continue;
    inverse.row(k).setConstant(kNaN);
    inverse.col(k).setConstant(kNaN);
  }
  fit.covariance.assign(inverse.data(), inverse.data() + inverse.size());
  for (Index k = 0; k < q; ++k)
    fit.standard_error[problem.index(k)] = std::sqrt(inverse(k, k));
}

}  // namespace shaker::estimator
