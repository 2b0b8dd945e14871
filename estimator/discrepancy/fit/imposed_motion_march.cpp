#include "estimator/discrepancy/fit/imposed_motion_march.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostNewton = 40;
constexpr double kSolved = 1e-10;

// The coordinate's name says so.
bool in_series(const Model& model, int coordinate) {
  return model.coordinate_name(coordinate).ends_with(".damper");
}

}  // namespace

bool parts_in_series(const Model& model) {
  for (int c = 1; c < model.coordinates(); ++c) {
    if (in_series(model, c)) return true;
  }
  return false;
}

MotionMarch::MotionMarch(const Model& model, Motion motion, bool inertia)
    : model_(&model),
      motion_(std::move(motion)),
      inertia_(inertia),
      n_(static_cast<int>(motion_.u.size())),
      s_(model.coordinates()),
      p_(model.parameter_count()),
      q_(s_ - 1) {
  if (model.mechanical() != 1)
    throw std::invalid_argument(
        fmt::format("{}: a motion can only be imposed on a model of one coordinate", model.name()));
  for (int c = 1; c < s_; ++c) {
    if (model.order(c) > 1)
      throw std::invalid_argument(
          fmt::format("{}: {} has inertia of its own and cannot be carried "
                      "along an imposed motion",
                      model.name(), model.coordinate_name(c)));
  }
  first_.resize(q_);
  for (int d = 0; d < q_; ++d) {
    // What is joined in series begins where the motion does.
    first_[d] = in_series(model, d + 1) ? motion_.u[0] : model.rest(d + 1);
  }
  one_.shape(model, 1);
  all_.shape(model, n_);
  std::copy(motion_.u.begin(), motion_.u.end(), all_.u[0]);
  std::copy(motion_.v.begin(), motion_.v.end(), all_.v[0]);
  std::copy(motion_.a.begin(), motion_.a.end(), all_.a[0]);
  if (motion_.x.size() > 0) std::copy(motion_.x.begin(), motion_.x.end(), all_.x);
  force_.resize(n_);
  slope_.resize(n_, p_);
  w_.resize(n_, q_);
  w_dot_.resize(n_, q_);
  s_w_.assign(3, MatrixXd::Zero(q_, p_));
  w_theta_.assign(static_cast<std::size_t>(q_), MatrixXd::Zero(n_, p_));
  w_dot_theta_ = w_theta_;
}

// One step of w' = (3 w - 4 w_1 + w_2) / 2 dt; the first is one of the first order.
bool MotionMarch::step(int i, std::span<const double> theta) {
  const int order = std::min(i, 2);
  const double now = (order == 2 ? 1.5 : order == 1 ? 1.0 : 0.0) / motion_.dt;
  const double last = (order == 2 ? -2.0 : order == 1 ? -1.0 : 0.0) / motion_.dt;
  const double before = (order == 2 ? 0.5 : 0.0) / motion_.dt;
  one_.u[0][0] = motion_.u[i];
  one_.v[0][0] = motion_.v[i];
  one_.a[0][0] = motion_.a[i];
  if (motion_.x.size() > 0) one_.x[0] = motion_.x[i];
  VectorXd w(q_), history = VectorXd::Zero(q_);
  for (int d = 0; d < q_; ++d) {
    w[d] = i > 0 ? w_(i - 1, d) : first_[d];
    if (i > 0) history[d] = last * w_(i - 1, d) + (order == 2 ? before * w_(i - 2, d) : 0.0);
  }
  const auto residual = [&](const VectorXd& trial, VectorXd& h) {
    for (int d = 0; d < q_; ++d) {
      one_.u[static_cast<std::size_t>(d + 1)][0] = trial[d];
      one_.v[static_cast<std::size_t>(d + 1)][0] = now * trial[d] + history[d];
    }
    if (!one_.evaluate(*model_, 1, theta.data())) return false;
    for (int d = 0; d < q_; ++d)
      h[d] = one_.g[static_cast<std::size_t>(d + 1)][0];
    return h.allFinite();
  };
  VectorXd h(q_), trial_h(q_);
  if (!residual(w, h)) return false;
  MatrixXd slope(q_, q_);
  const auto jacobian = [&] {
    for (int d = 0; d < q_; ++d) {
      for (int e = 0; e < q_; ++e) {
        const auto de = static_cast<std::size_t>((d + 1) * s_ + e + 1);
        slope(d, e) = one_.g_u[de][0] + now * one_.g_v[de][0];
      }
    }
  };
  // At the first point there is no rate: what is memory stays at rest.
  for (int round = 0; i > 0 && round < kMostNewton; ++round) {
    jacobian();
    const VectorXd move = solve_square(slope, h);
    if (!move.allFinite()) return false;
    double share = 1.0;
    bool better = false;
    const double norm = h.norm();
    for (; share > 1e-4 && !better; share *= 0.5) {
      const VectorXd trial = w - share * move;
      better = residual(trial, trial_h) && (trial_h.norm() < norm || norm < 1e-14);
      if (better) {
        w = trial;
        h = trial_h;
      }
    }
    const double size = std::max(w.cwiseAbs().maxCoeff(), 1e-9);
    if (!better) {
      if (!residual(w, h)) return false;
      if (move.cwiseAbs().maxCoeff() > 1e-5 * size) return false;
      break;
    }
    if (move.cwiseAbs().maxCoeff() < kSolved * size) break;
  }
  MatrixXd& s_now = s_w_[static_cast<std::size_t>(i % 3)];
  MatrixXd s_history = MatrixXd::Zero(q_, p_);
  if (i > 0) {
    jacobian();
    s_history = last * s_w_[static_cast<std::size_t>((i + 2) % 3)];
    if (order == 2) s_history += before * s_w_[static_cast<std::size_t>((i + 1) % 3)];
    MatrixXd right(q_, p_);
    for (int d = 0; d < q_; ++d) {
      for (int k = 0; k < p_; ++k) {
        right(d, k) = -one_.g_theta[static_cast<std::size_t>((d + 1) * p_ + k)][0];
        for (int e = 0; e < q_; ++e)
          right(d, k) -=
              one_.g_v[static_cast<std::size_t>((d + 1) * s_ + e + 1)][0] * s_history(e, k);
      }
    }
    s_now = solve_square(slope, right);
  } else {
    s_now.setZero();
  }
  for (int d = 0; d < q_; ++d) {
    w_(i, d) = w[d];
    w_dot_(i, d) = now * w[d] + history[d];
    w_theta_[static_cast<std::size_t>(d)].row(i) = s_now.row(d);
    w_dot_theta_[static_cast<std::size_t>(d)].row(i) = now * s_now.row(d) + s_history.row(d);
  }
  return s_now.allFinite();
}

bool MotionMarch::march(std::span<const double> theta) {
  for (int i = 0; i < n_; ++i) {
    if (!step(i, theta)) return false;
  }
  for (int d = 0; d < q_; ++d) {
    const auto c = static_cast<std::size_t>(d + 1);
    std::copy(w_.col(d).begin(), w_.col(d).end(), all_.u[c]);
    std::copy(w_dot_.col(d).begin(), w_dot_.col(d).end(), all_.v[c]);
  }
  return true;
}

bool MotionMarch::at(std::span<const double> theta) {
  if (q_ > 0 && !march(theta)) return false;
  if (!all_.evaluate(*model_, n_, theta.data())) return false;
  const double mass = inertia_ ? 0.0 : model_->mass(0, 0);
  for (int i = 0; i < n_; ++i) {
    force_[i] = all_.g[0][i] - mass * motion_.a[i];
    for (int k = 0; k < p_; ++k)
      slope_(i, k) = all_.g_theta[static_cast<std::size_t>(k)][i];
  }
  for (int d = 0; d < q_; ++d) {
    const auto c = static_cast<std::size_t>(d + 1);
    const Eigen::Map<const VectorXd> over(all_.g_u[c], n_), over_rate(all_.g_v[c], n_);
    slope_ += over.asDiagonal() * w_theta_[c - 1];
    slope_ += over_rate.asDiagonal() * w_dot_theta_[c - 1];
  }
  return force_.allFinite() && slope_.allFinite();
}

}  // namespace shaker::estimator::discrepancy
