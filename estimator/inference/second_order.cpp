#include "estimator/inference/second_order.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kStep = 0.1;  // step of the differences, in standard errors

// The problem in coordinates in which V is the unit matrix, in units of the noise: directions,
// first and second derivatives.
struct Bent {
  MatrixXd directions;         // columns: a change of the free parameters by one standard error
  MatrixXd slope;              // Jacobian, data x q
  std::vector<MatrixXd> bend;  // [k]: data x q, second derivatives along k and each other direction
};

class Looker {
 public:
  Looker(Estimator& estimator, const Model& model)
      : estimator_(estimator), all_(estimator.last().theta) {
    for (int k = 0; k < model.parameter_count(); ++k) {
      if (!model.parameters()[static_cast<std::size_t>(k)].fixed) free_.push_back(k);
    }
  }
  Index count() const { return static_cast<Index>(free_.size()); }
  std::size_t index(Index k) const {
    return static_cast<std::size_t>(free_[static_cast<std::size_t>(k)]);
  }

  // The Jacobian over the free parameters at theta + change. False if there is no solution.
  bool rows(const VectorXd& change, MatrixXd& out) {
    std::vector<double> theta = all_;
    for (Index k = 0; k < count(); ++k)
      theta[index(k)] += change[k];
    if (!estimator_.linearise_at(theta)) return false;
    const Linearised at = estimator_.linearised();
    const auto data = static_cast<Index>(at.residual.size());
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
        full(at.jacobian.data(), data, static_cast<Index>(all_.size()));
    out.resize(data, count());
    for (Index k = 0; k < count(); ++k)
      out.col(k) = full.col(static_cast<Index>(index(k)));
    return true;
  }

 private:
  Estimator& estimator_;
  std::vector<double> all_;
  std::vector<int> free_;
};

std::optional<Bent> bent(Looker& look, const MatrixXd& covariance, double noise) {
  const Cholesky factor(covariance);
  if (!factor.positive() || !(noise > 0.0)) return std::nullopt;
  Bent out;
  out.directions = factor.root();
  MatrixXd there, back;
  for (Index k = 0; k < look.count(); ++k) {
    const VectorXd step = kStep * out.directions.col(k);
    if (!look.rows(step, there) || !look.rows(-step, back)) return std::nullopt;
    out.bend.push_back((there - back) * out.directions / (2.0 * kStep * noise));
  }
  if (!look.rows(VectorXd::Zero(look.count()), there)) return std::nullopt;
  out.slope = there * out.directions / noise;
  return out;
}

// Standard deviations of Bhattacharyya's bound, transformed from the coordinates of `b` to theta.
VectorXd bound(const Bent& b) {
  const Index q = b.slope.cols();
  std::vector<std::pair<Index, Index>> pairs;
  for (Index i = 0; i < q; ++i) {
    for (Index j = i; j < q; ++j)
      pairs.emplace_back(i, j);
  }
  const auto second = static_cast<Index>(pairs.size());
  const MatrixXd gram = b.slope.transpose() * b.slope;
  MatrixXd all(q + second, q + second);
  all.topLeftCorner(q, q) = gram;
  const auto bend = [&](std::pair<Index, Index> at) {
    return b.bend[static_cast<std::size_t>(at.first)].col(at.second);
  };
  for (Index m = 0; m < second; ++m) {
    const auto& left = pairs[static_cast<std::size_t>(m)];
    all.col(q + m).head(q) = b.slope.transpose() * bend(left);
    all.row(q + m).head(q) = all.col(q + m).head(q).transpose();
    for (Index n = 0; n < second; ++n) {
      const auto& right = pairs[static_cast<std::size_t>(n)];
      all(q + m, q + n) = bend(left).dot(bend(right)) +
                          gram(left.first, right.first) * gram(left.second, right.second) +
                          gram(left.first, right.second) * gram(left.second, right.first);
    }
  }
  const MatrixXd inverse = Ldlt(all).solve(MatrixXd(MatrixXd::Identity(q + second, q)));
  return (b.directions * inverse.topRows(q) * b.directions.transpose()).diagonal().cwiseSqrt();
}

// True if the linearisations ended on another solution than they began with, as can happen at a
// fold.
bool strayed(const std::vector<double>& before, const std::vector<double>& after, double noise) {
  constexpr double kMaxSolutionChange =
      1e-3;  // of the noise; the same solution returns much closer
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!(std::fabs(after[i] - before[i]) <= kMaxSolutionChange * noise)) return true;
  }
  return false;
}

Correction correction(const std::optional<SecondOrder>& effect, Bias rule) {
  if (rule == Bias::off) return Correction::none;
  if (rule == Bias::always)
    return effect && effect->inside ? Correction::taken_off : Correction::left_in;
  if (!effect || effect->largest_bias <= kSmallestBias) return Correction::none;
  const bool trusted = effect->largest_bias <= kLargestBias && effect->inside;
  return trusted ? Correction::taken_off : Correction::left_in;
}

std::string why_left_in(const std::optional<SecondOrder>& effect) {
  if (!effect) return "the bias could not be computed at this estimate; it was left in";
  if (!effect->inside)
    return "the estimate without its bias would be beyond a bound; the bias was left in";
  return fmt::format(
      "the bias of the estimate is about {:.2f} standard errors, too much to be taken off reliably "
      "(at most {:g}); it was left in: see the profile intervals, or measure at a larger amplitude",
      effect->largest_bias, kLargestBias);
}

}  // namespace

bool has_second_order(const Fit& fit) {
  const auto set = [](char flag) { return flag != 0; };
  return fit.status == FitStatus::converged && !fit.covariance.empty() &&
         std::none_of(fit.at_bound.begin(), fit.at_bound.end(), set);
}

std::optional<SecondOrder> second_order(Estimator& estimator, const Model& model) {
  const Fit& fit = estimator.last();
  if (!has_second_order(fit)) return std::nullopt;
  // The fit's own solutions are less accurate. Solve them again for the comparison below.
  estimator.restore_solutions();
  const std::vector<double> before = estimator.linearised().residual;
  Looker look(estimator, model);
  const Index q = look.count();
  const MatrixXd covariance = Eigen::Map<const MatrixXd>(fit.covariance.data(), q, q);
  const std::optional<Bent> b = bent(look, covariance, estimator.unit_noise());
  estimator.restore_solutions();
  if (!b || strayed(before, estimator.linearised().residual, estimator.unit_noise()))
    return std::nullopt;
  VectorXd trace = VectorXd::Zero(b->slope.rows());
  for (Index k = 0; k < q; ++k)
    trace += b->bend[static_cast<std::size_t>(k)].col(k);
  // Priors are linear data. The covariance may contain more than the noise, so it is not used here.
  const MatrixXd slope = b->slope * inverse_of(b->directions);
  MatrixXd information = slope.transpose() * slope;
  for (Index k = 0; k < q; ++k) {
    const ModelParameter& p = model.parameters()[look.index(k)];
    if (p.prior_mean)
      information(k, k) += 1.0 / (*p.prior_standard_deviation * *p.prior_standard_deviation);
  }
  const VectorXd bias = -0.5 * Ldlt(information).solve(VectorXd(slope.transpose() * trace));
  if (!bias.allFinite()) return std::nullopt;
  const VectorXd least = bound(*b);
  SecondOrder out;
  out.bias.assign(fit.theta.size(), 0.0);
  out.bound.assign(fit.theta.size(), 0.0);
  for (Index k = 0; k < q; ++k) {
    out.bias[look.index(k)] = bias[k];
    out.bound[look.index(k)] = least[k];
    out.largest_bias =
        std::max(out.largest_bias, std::fabs(bias[k]) / fit.standard_error[look.index(k)]);
    const ModelParameter& p = model.parameters()[look.index(k)];
    const double without = fit.theta[look.index(k)] - bias[k];
    out.inside = out.inside && without >= p.lower && without <= p.upper;
  }
  return out;
}

Correction take_off_bias(Fit& fit, const std::optional<SecondOrder>& effect, Bias rule) {
  const Correction done = correction(effect, rule);
  if (done != Correction::taken_off) return done;
  for (std::size_t k = 0; k < fit.theta.size(); ++k)
    fit.theta[k] -= effect->bias[k];
  return done;
}

Correction take_off_bias(Estimate& estimate, const std::optional<SecondOrder>& effect, Bias rule) {
  const Correction done = correction(effect, rule);
  if (done == Correction::left_in) estimate.warnings.push_back(why_left_in(effect));
  if (done != Correction::taken_off) return done;
  for (std::size_t k = 0; k < estimate.parameters.size(); ++k) {
    estimate.parameters[k].bias = effect->bias[k];
    estimate.parameters[k].value -= effect->bias[k];
  }
  if (!(effect->largest_bias <= kLargestBias))
    estimate.warnings.push_back(
        fmt::format("the bias that was taken off is about {:.2f} standard errors, more than its "
                    "series is to be trusted with ({:g})",
                    effect->largest_bias, kLargestBias));
  return done;
}

Estimate published(Estimator& estimator, const Model& model, Bias rule) {
  Estimate estimate = estimator.describe();
  if (rule != Bias::off) take_off_bias(estimate, second_order(estimator, model), rule);
  return estimate;
}

std::optional<Bias> bias_from_name(std::string_view name) {
  for (const Bias rule : {Bias::automatic, Bias::off, Bias::always}) {
    if (name == estimator::name(rule)) return rule;
  }
  return std::nullopt;
}

std::string_view name(Bias rule) {
  if (rule == Bias::off) return "off";
  return rule == Bias::always ? "always" : "auto";
}

}  // namespace shaker::estimator
