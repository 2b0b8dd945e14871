// The force along the course of a MotionIntegrator, and the derivatives of both over the parameters.
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;

constexpr double kBendsRepeated = 1e-8;  // of a derivative, from cycle to cycle

}  // namespace

// Carries w's derivatives over theta along a block, from the derivatives of the model at its
// points, and adds what they do to the force.
void MotionIntegrator::carry_slopes(int first, int last) {
  auto& [now, one, two, three, history, cycle, size, changes] = bends_;
  const int all = q_ * p_;
  if (first == 0) {
    now = one = two = three = history = VectorXd::Zero(all);
    cycle.setZero(all, n_);
    size = VectorXd::Constant(all, 1e-300);
  }
  for (int row = std::max(first, 1); row < last; ++row) {
    const int i = row - first, at = row % n_;
    const Difference rate = difference_at(row);
    three.swap(two);
    two.swap(one);
    one.swap(now);
    history = rate.one * one + rate.two * two + rate.three * three;
    slope_at(block_, i, rate.now, step_.slope.data());
    for (int d = 0; d < q_; ++d) {
      double* of = &now[d * p_];
      for (int k = 0; k < p_; ++k)
        of[k] = -block_.g_theta[static_cast<std::size_t>((d + 1) * p_ + k)][i];
      for (int e = 0; e < q_; ++e) {
        const double over = block_.g_v[static_cast<std::size_t>((d + 1) * s_ + e + 1)][i];
        for (int k = 0; k < p_; ++k)
          of[k] -= over * history[e * p_ + k];
      }
    }
    solve(step_.slope.data(), now.data(), p_);
    size = size.cwiseMax(now.cwiseAbs());
    if (row + kHistory >= last)  // those that tell whether the cycle repeats
      changes[static_cast<std::size_t>(last - 1 - row)] =
          (now - cycle.col(at)).cwiseAbs().cwiseQuotient(size).maxCoeff();
    cycle.col(at) = now;
    if (at % steps_between_ != 0) continue;
    for (int d = 0; d < q_; ++d) {
      const auto c = static_cast<std::size_t>(d + 1);
      const double over_w = block_.g_u[c][i] + rate.now * block_.g_v[c][i];
      for (int k = 0; k < p_; ++k)
        slope_(at / steps_between_, k) +=
            over_w * now[d * p_ + k] + block_.g_v[c][i] * history[d * p_ + k];
    }
  }
}

// Force and slopes along the course: of the last cycle, until its slopes repeat those of the one
// before.
bool MotionIntegrator::follow(std::span<const double> theta, bool slopes) {
  const double mass = inertia_ ? 0.0 : model_->mass(0, 0);
  const bool bends = slopes && q_ > 0;
  const int end = bends ? rows_ : marched_;
  for (int first = bends ? 0 : marched_ - n_; first < end; first += kBlock) {
    const int last = std::min(first + kBlock, end);
    load(first, last);
    if (!afford(last - first) || !block_.evaluate(*model_, last - first, theta.data()))
      return false;
    for (int row = first; row < last; ++row) {
      const int i = row - first, at = row % n_, point = at / steps_between_;
      if (at % steps_between_ != 0) continue;
      force_[point] = block_.g[0][i] - mass * motion_.a[at];
      if (!slopes) continue;
      for (int k = 0; k < p_; ++k)
        slope_(point, k) = block_.g_theta[static_cast<std::size_t>(k)][i];
    }
    if (bends) carry_slopes(first, last);
    if (last >= std::max(marched_, n_ + 2 * kHistory) &&
        std::ranges::max(bends_.changes) < kBendsRepeated)
      break;
  }
  return force_.allFinite() && (!slopes || slope_.allFinite());
}

// Moves the course along its derivatives over theta, as they were in the last cycle.
void MotionIntegrator::predict(std::span<const double> theta) {
  if (bends_at_.empty() || std::equal(theta.begin(), theta.end(), bends_at_.begin())) return;
  const VectorXd by = Eigen::Map<const VectorXd>(theta.data(), p_) -
                      Eigen::Map<const VectorXd>(bends_at_.data(), p_);
  for (int row = 1; row < rows_; ++row) {
    const auto along = bends_.cycle.col(row % n_);
    for (int d = 0; d < q_; ++d)
      w_(row, d) += along.segment(d * p_, p_).dot(by);
  }
}

}  // namespace shaker::estimator::diagnosis
