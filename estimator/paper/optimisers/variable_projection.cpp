// Variable projection (Golub and Pereyra 1973). The parameters in which the model is linear are
// solved for at every step of the others. The remaining problem is smaller and better conditioned:
// NIST's MGH10 takes 20 steps instead of thousands. A parameter counts as linear if its column of J
// does not change with it. The Jacobian of the reduced problem is that of Kaufman (1975). This is
// our own code because neither Ceres nor NLopt has the method.
//
// Bounded parameters are not projected. Without a linear parameter the method is
// Levenberg-Marquardt.
#include <algorithm>
#include <cmath>

#include <Eigen/QR>

#include "estimator/math/dense.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

// Finds parameters in which the model is jointly linear: their columns of J do not change when all
// of them move.
std::vector<int> linear_parameters(LeastSquaresProblem& problem, const Eigen::VectorXd& start) {
  const Eigen::VectorXd lower = problem.lower(), upper = problem.upper();
  Eigen::VectorXd e;
  Eigen::MatrixXd before, after;
  std::vector<int> linear;
  for (int k = 0; k < problem.parameters(); ++k) {
    if (std::isfinite(lower[k]) || std::isfinite(upper[k])) continue;
    if (before.size() == 0 && !problem.evaluate(start, e, &before)) return {};
    std::vector<int> with = linear;
    with.push_back(k);
    Eigen::VectorXd moved = start;
    for (const int l : with)
      moved[l] += 0.37 * (1.0 + l) * std::max(std::fabs(start[l]), 1e-3);
    if (!problem.evaluate(moved, e, &after)) continue;
    const bool same = std::all_of(with.begin(), with.end(), [&](int l) {
      return (after.col(l) - before.col(l)).norm() <= 1e-12 * before.col(l).norm();
    });
    if (same) linear = with;
  }
  return linear;
}

class Reduced final : public LeastSquaresProblem {
 public:
  Reduced(LeastSquaresProblem& whole, Eigen::VectorXd start, std::vector<int> linear)
      : whole_(whole), theta_(std::move(start)), linear_(std::move(linear)) {
    for (int k = 0; k < whole.parameters(); ++k) {
      if (std::find(linear_.begin(), linear_.end(), k) == linear_.end()) rest_.push_back(k);
    }
  }
  int parameters() const override { return static_cast<int>(rest_.size()); }
  int observations() const override { return whole_.observations(); }
  Eigen::VectorXd lower() const override { return pick(whole_.lower(), rest_); }
  Eigen::VectorXd upper() const override { return pick(whole_.upper(), rest_); }
  Eigen::VectorXd reduced(const Eigen::VectorXd& theta) const { return pick(theta, rest_); }

  bool evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                Eigen::MatrixXd* jacobian) override {
    Eigen::MatrixXd full;
    for (std::size_t k = 0; k < rest_.size(); ++k)
      theta_[rest_[k]] = theta[static_cast<Eigen::Index>(k)];
    if (!whole_.evaluate(theta_, e, &full) || !full.allFinite() || !e.allFinite()) return false;
    const Eigen::MatrixXd basis = some(full, linear_);
    const PivotedQr qr(basis);
    const Eigen::VectorXd step = qr.solve(e);
    for (std::size_t k = 0; k < linear_.size(); ++k)
      theta_[linear_[k]] += step[static_cast<Eigen::Index>(k)];
    evaluations_ += jacobian != nullptr ? 2 : 1;
    if (jacobian == nullptr) {
      e -= basis * step;
      return true;
    }
    if (!whole_.evaluate(theta_, e, &full)) return false;
    const Eigen::MatrixXd others = some(full, rest_);
    *jacobian = others - basis * qr.solve(others);
    return true;
  }
  // All parameters, with the best values of the linear ones.
  Eigen::VectorXd whole(const Eigen::VectorXd& theta) {
    Eigen::VectorXd e;
    Eigen::MatrixXd j;
    evaluate(theta, e, &j);
    return theta_;
  }
  int evaluations() const { return evaluations_; }

 private:
  static Eigen::VectorXd pick(const Eigen::VectorXd& from, const std::vector<int>& which) {
    Eigen::VectorXd out(static_cast<Eigen::Index>(which.size()));
    for (std::size_t k = 0; k < which.size(); ++k)
      out[static_cast<Eigen::Index>(k)] = from[which[k]];
    return out;
  }
  static Eigen::MatrixXd some(const Eigen::MatrixXd& from, const std::vector<int>& which) {
    Eigen::MatrixXd out(from.rows(), static_cast<Eigen::Index>(which.size()));
    for (std::size_t k = 0; k < which.size(); ++k)
      out.col(static_cast<Eigen::Index>(k)) = from.col(which[k]);
    return out;
  }

  LeastSquaresProblem& whole_;
  Eigen::VectorXd theta_;
  std::vector<int> linear_, rest_;
  int evaluations_ = 0;
};

}  // namespace

Summary variable_projection(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                            const Options& options) {
  Eigen::VectorXd from = start.cwiseMax(problem.lower()).cwiseMin(problem.upper());
  const auto linear = linear_parameters(problem, from);
  Summary first;
  if (!linear.empty() && static_cast<int>(linear.size()) < problem.parameters()) {
    Reduced reduced(problem, from, linear);
    first = levenberg_marquardt(reduced, reduced.reduced(from), options);
    first.evaluations = reduced.evaluations();
    if (first.status != Status::inadmissible) from = reduced.whole(first.theta);
  }
  // The last steps change all parameters. If the reduced problem converged, there are none left.
  Summary out = levenberg_marquardt(problem, from, options);
  out.method = "variable_projection";
  out.iterations += first.iterations;
  out.evaluations += first.evaluations;
  out.jacobians += first.jacobians;
  out.refused += first.refused;
  return out;
}

}  // namespace shaker::estimator::optimisers
