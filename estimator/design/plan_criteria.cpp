#include "estimator/design/internal/plan_criteria.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "estimator/design/internal/plan_candidates.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator {
namespace {

// Weak prior for ranking sets that do not determine all parameters: a relative standard
// deviation of 1000 for every parameter.
constexpr double kWeakPrior = 1e-6;
// The same of 100 for a value of a single run: its run may not determine it.
constexpr double kWeakPriorOfRun = 1e-4;
// A plan with an aim weighs the logarithm of the volume by this, so that the set leaves no other
// parameter open.
constexpr double kShareOfVolume = 0.05;

using Eigen::Index;
using Eigen::MatrixXd;

// The information on the joint parameters, and on the means over the runs of those that have a
// value in each run. `own`: indices of the latter; `prior`: of the joint parameters, and of each of
// those values.
MatrixXd with_means(const std::vector<MatrixXd>& runs, const MatrixXd& prior,
                    const std::vector<Index>& own) {
  std::vector<Index> joint;
  for (Index k = 0; k < prior.rows(); ++k) {
    if (std::find(own.begin(), own.end(), k) == own.end()) joint.push_back(k);
  }
  const auto size = static_cast<Index>(own.size());
  const MatrixXd unit = MatrixXd::Identity(size, size);
  MatrixXd marginal = prior(joint, joint), spread = MatrixXd::Zero(size, size);
  MatrixXd bends = MatrixXd::Zero(size, static_cast<Index>(joint.size()));
  for (const MatrixXd& run : runs) {
    const MatrixXd across = run(own, joint);
    const MatrixXd inverse =
        Cholesky(run(own, own) + prior(own, own) + kWeakPriorOfRun * unit).solve(unit);
    marginal += run(joint, joint) - across.transpose() * inverse * across;
    spread += inverse;
    bends += inverse * across;
  }
  // Given the joint parameters, the mean of the values has the covariance spread / runs^2, and
  // follows them by -bends / runs.
  const auto count = static_cast<double>(runs.size());
  const MatrixXd of_mean = count * count * Cholesky(spread).solve(unit);
  bends /= count;
  MatrixXd all(prior.rows(), prior.cols());
  all(joint, joint) = marginal + bends.transpose() * of_mean * bends;
  all(own, joint) = of_mean * bends;
  all(joint, own) = MatrixXd(all(own, joint)).transpose();
  all(own, own) = of_mean;
  return all;
}

}  // namespace

RunShares equally(std::vector<std::size_t> runs) {
  const std::size_t count = runs.size();
  return {std::move(runs), std::vector<double>(count, 1.0 / static_cast<double>(count))};
}

PlanCriteria::PlanCriteria(const Model& model, const PlanOptions& options,
                           const std::vector<PlanCandidate>& candidates,
                           const std::vector<int>& free)
    : options_(options), candidates_(candidates), free_(free) {
  for (std::size_t k = 0; k < free_.size(); ++k) {
    const auto at = static_cast<std::size_t>(free_[k]);
    if (model.parameters()[at].variation.per == "run") own_.push_back(static_cast<Index>(k));
  }
  at_.push_back(at(model, point_of(model, options), options.aim, -1));
  for (std::size_t i = 0; i < options.prior.size(); ++i)
    at_.push_back(at(model, options.prior[i].theta, options.prior[i].aim, static_cast<int>(i)));
}

PlanCriteria::At PlanCriteria::at(const Model& model, const std::vector<double>& theta,
                                  const std::vector<double>& aim, int which) const {
  const auto q = static_cast<Eigen::Index>(free_.size());
  At one = {Eigen::VectorXd(q), Eigen::VectorXd::Zero(q), Eigen::MatrixXd::Zero(q, q), which};
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(free_[static_cast<std::size_t>(k)]);
    one.scale[k] = size_of(theta[at]);
    const auto& sigma = model.parameters()[at].prior_standard_deviation;
    if (sigma) one.prior(k, k) = one.scale[k] * one.scale[k] / (*sigma * *sigma);
    if (!aim.empty()) one.aim[k] = aim[at] * one.scale[k];
  }
  return one;
}

double PlanCriteria::cycles(const RunShares& set, std::size_t i) const {
  if (!(options_.minutes > 0.0)) return options_.cycles;
  const double seconds = 60.0 * options_.minutes * set.share[i];
  return std::max(0.0, seconds * candidates_[set.runs[i]].frequency_hz - options_.settle_cycles);
}

Eigen::MatrixXd PlanCriteria::information(const RunShares& set, const At& at) const {
  const auto q = static_cast<Eigen::Index>(free_.size());
  std::vector<MatrixXd> runs;
  for (std::size_t i = 0; i < set.runs.size(); ++i) {
    const PlanCandidate& c = candidates_[set.runs[i]];
    const std::vector<double>& values =
        at.which < 0 ? c.information : c.over_prior[static_cast<std::size_t>(at.which)];
    const Eigen::Map<const Eigen::MatrixXd> own(values.data(), q, q);
    runs.emplace_back(cycles(set, i) / options_.cycles *
                      (at.scale.asDiagonal() * own * at.scale.asDiagonal()));
  }
  return own_.empty() ? std::accumulate(runs.begin(), runs.end(), at.prior)
                      : with_means(runs, at.prior, own_);
}

Eigen::MatrixXd PlanCriteria::with_weak_prior(const RunShares& set, const At& at) const {
  const auto q = static_cast<Eigen::Index>(free_.size());
  return information(set, at) + kWeakPrior * Eigen::MatrixXd::Identity(q, q);
}

double PlanCriteria::volume(const RunShares& set, const At& at) const {
  const Eigen::VectorXd root = Cholesky(with_weak_prior(set, at)).root().diagonal();
  double sum = 0.0;
  for (Eigen::Index k = 0; k < root.size(); ++k)
    sum += std::log(root[k]);
  return -sum / static_cast<double>(root.size());
}

double PlanCriteria::volume(const RunShares& set) const {
  return volume(set, at_.front());
}

double PlanCriteria::error_of(const RunShares& set, Eigen::Index k) const {
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(at_.front().scale.size(), k);
  return Cholesky(with_weak_prior(set, at_.front())).solve(unit)[k];
}

double PlanCriteria::aim_error(const RunShares& set, const At& at) const {
  return std::sqrt(std::max(0.0, at.aim.dot(Cholesky(with_weak_prior(set, at)).solve(at.aim))));
}

double PlanCriteria::aim_over_prior(const RunShares& set) const {
  if (at_.size() == 1) return aim_error(set, at_.front());
  std::vector<double> errors;
  for (std::size_t i = 1; i < at_.size(); ++i)
    errors.push_back(aim_error(set, at_[i]));
  std::sort(errors.begin(), errors.end());
  const std::size_t half = errors.size() / 2;
  return errors.size() % 2 == 1 ? errors[half] : 0.5 * (errors[half - 1] + errors[half]);
}

double PlanCriteria::criterion(const RunShares& set) const {
  if (!aims()) return volume(set);
  double sum = 0.0;
  const std::size_t first = at_.size() > 1 ? 1 : 0;
  for (std::size_t i = first; i < at_.size(); ++i)
    sum += std::log(aim_error(set, at_[i])) + kShareOfVolume * volume(set, at_[i]);
  return sum / static_cast<double>(at_.size() - first);
}

}  // namespace shaker::estimator
