#include "estimator/diagnosis/fit/imposed_motion_bdf2.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostNewton = 40;
constexpr double kSolved = 1e-10;
constexpr int kMostCorrections = 12;  // of a course; an integration costs about as much as 30

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

bool can_be_carried(const Model& model) {
  if (model.mechanical() != 1) return false;
  for (int c = 1; c < model.coordinates(); ++c) {
    if (model.order(c) > 1) return false;
  }
  return true;
}

MotionIntegrator::MotionIntegrator(const Model& model, Motion motion, bool inertia)
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
}

// w' = (3 w - 4 w_1 + w_2) / 2 dt; at the second step one of the first order, at the first none.
MotionIntegrator::Difference MotionIntegrator::difference_at(int i) const {
  if (i == 0) return {};
  if (i == 1) return {1.0 / motion_.dt, -1.0 / motion_.dt, 0.0};
  return {1.5 / motion_.dt, -2.0 / motion_.dt, 0.5 / motion_.dt};
}

// The equations of what is carried along, at the values w and the rates now * w + history.
bool MotionIntegrator::residual(const VectorXd& w, double now, const VectorXd& history,
                                std::span<const double> theta, VectorXd& h) {
  for (int d = 0; d < q_; ++d) {
    const auto c = static_cast<std::size_t>(d + 1);
    one_.u[c][0] = w[d];
    one_.v[c][0] = now * w[d] + history[d];
  }
  if (!afford(1) || !one_.evaluate_internal(*model_, 1, theta.data())) return false;
  for (int d = 0; d < q_; ++d)
    h[d] = one_.g[static_cast<std::size_t>(d + 1)][0];
  return h.allFinite();
}

// The derivative of these equations over w, from the i-th point of the arrays.
void MotionIntegrator::slope_at(const ModelArrays& arrays, int i, double now,
                                MatrixXd& slope) const {
  for (int d = 0; d < q_; ++d) {
    for (int e = 0; e < q_; ++e) {
      const auto de = static_cast<std::size_t>((d + 1) * s_ + e + 1);
      slope(d, e) = arrays.g_u[de][i] + now * arrays.g_v[de][i];
    }
  }
}

// An evaluation gives the force, what is carried along and their slopes.
bool MotionIntegrator::afford(int points) {
  return !budget_ || budget_->spend_rates(static_cast<double>(points) * s_ * (s_ + p_));
}

// Damped Newton for w at one step.
bool MotionIntegrator::solve_step(double now, const VectorXd& history,
                                  std::span<const double> theta, VectorXd& w) {
  auto& [h, trial, trial_h, slope, move] = step_;
  if (!residual(w, now, history, theta, h)) return false;
  for (int round = 0; round < kMostNewton; ++round) {
    slope_at(one_, 0, now, slope);
    move.col(0) = h;
    solve(slope, move);
    if (!move.allFinite()) return false;
    const double length = move.cwiseAbs().maxCoeff();
    if (length < kSolved * std::max(w.cwiseAbs().maxCoeff(), 1e-9)) {
      w -= move.col(0);
      return true;
    }
    bool better = false;
    const double norm = h.norm();
    for (double share = 1.0; share > 1e-4 && !better; share *= 0.5) {
      trial = w - share * move.col(0);
      better =
          residual(trial, now, history, theta, trial_h) && (trial_h.norm() < norm || norm < 1e-14);
    }
    if (!better) return length <= 1e-5 * std::max(w.cwiseAbs().maxCoeff(), 1e-9);
    w.swap(trial);
    h.swap(trial_h);
  }
  return true;
}

void MotionIntegrator::begin_from(const MotionIntegrator& other) {
  const int stride = other.n_ / n_;
  if (!other.has_course_ || stride * n_ != other.n_) return;
  for (int d = 0; d < q_; ++d) {
    int e = 0;
    while (e < other.q_ && other.model_->coordinate_name(e + 1) != model_->coordinate_name(d + 1))
      ++e;
    if (e == other.q_) return;
    for (int i = 0; i < n_; ++i)
      w_(i, d) = other.w_(stride * i, e);
  }
  has_course_ = true;
}

// right = slope^-1 right, both with a row for each carried coordinate; `slope` is destroyed. Gauss
// with row exchanges: the matrices are too small for a library's.
void MotionIntegrator::solve(MatrixXd& slope, MatrixXd& right) const {
  const Index columns = right.cols();
  for (int d = 0; d < q_; ++d) {
    int pivot = d;
    for (int r = d + 1; r < q_; ++r) {
      if (std::fabs(slope(r, d)) > std::fabs(slope(pivot, d))) pivot = r;
    }
    if (pivot != d) {
      slope.row(d).swap(slope.row(pivot));
      right.row(d).swap(right.row(pivot));
    }
    for (int r = d + 1; r < q_; ++r) {
      const double factor = slope(r, d) / slope(d, d);
      for (int e = d + 1; e < q_; ++e)
        slope(r, e) -= factor * slope(d, e);
      for (Index k = 0; k < columns; ++k)
        right(r, k) -= factor * right(d, k);
    }
  }
  for (int d = q_; d-- > 0;) {
    for (Index k = 0; k < columns; ++k) {
      for (int e = d + 1; e < q_; ++e)
        right(d, k) -= slope(d, e) * right(e, k);
      right(d, k) /= slope(d, d);
    }
  }
}

// Carries w along the motion, step by step.
bool MotionIntegrator::integrate(std::span<const double> theta) {
  VectorXd w = first_, history(q_);
  for (VectorXd* values : {&step_.h, &step_.trial, &step_.trial_h})
    values->resize(q_);
  step_.slope.resize(q_, q_);
  step_.move.resize(q_, 1);
  for (int i = 0; i < n_; ++i) {
    const Difference rate = difference_at(i);
    one_.u[0][0] = motion_.u[i];
    one_.v[0][0] = motion_.v[i];
    one_.a[0][0] = motion_.a[i];
    if (motion_.x.size() > 0) one_.x[0] = motion_.x[i];
    history.setZero();
    if (i > 0) history += rate.last * w_.row(i - 1).transpose();
    if (i > 1) history += rate.before * w_.row(i - 2).transpose();
    // At the first point there is no rate: what is memory stays at rest.
    if (i > 0 && !solve_step(rate.now, history, theta, w)) return false;
    w_.row(i) = w.transpose();
  }
  load_course();
  return true;
}

// Writes w and its rate into the arrays of all points.
void MotionIntegrator::load_course() {
  for (int d = 0; d < q_; ++d) {
    const auto c = static_cast<std::size_t>(d + 1);
    const auto w = w_.col(d);
    for (int i = 0; i < n_; ++i) {
      const Difference rate = difference_at(i);
      all_.u[c][i] = w[i];
      all_.v[c][i] = rate.now * w[i] + (i > 0 ? rate.last * w[i - 1] : 0.0) +
                     (i > 1 ? rate.before * w[i - 2] : 0.0);
    }
  }
}

// Newton for all steps together, from the present course: nearby parameters have a nearby course.
// Each step is a forward substitution. The points are evaluated together, which costs a small part
// of what an integration costs. Returns false if it does not converge; w is then undefined.
bool MotionIntegrator::correct_course(std::span<const double> theta) {
  MatrixXd slope(q_, q_), now(q_, 1), last(q_, 1), before(q_, 1);
  w_.row(0) = first_.transpose();
  for (int round = 0; round < kMostCorrections; ++round) {
    load_course();
    if (!afford(n_) || !all_.evaluate_internal(*model_, n_, theta.data())) return false;
    double largest = 0.0;
    now.setZero();
    last.setZero();
    for (int i = 1; i < n_; ++i) {
      const Difference rate = difference_at(i);
      before.swap(last);
      last.swap(now);
      slope_at(all_, i, rate.now, slope);
      for (int d = 0; d < q_; ++d) {
        now(d, 0) = -all_.g[static_cast<std::size_t>(d + 1)][i];
        for (int e = 0; e < q_; ++e)
          now(d, 0) -= all_.g_v[static_cast<std::size_t>((d + 1) * s_ + e + 1)][i] *
                       (rate.last * last(e, 0) + rate.before * before(e, 0));
      }
      solve(slope, now);
      if (!now.allFinite()) return false;
      w_.row(i) += now.col(0).transpose();
      largest = std::max(
          largest, now.cwiseAbs().maxCoeff() / std::max(w_.row(i).cwiseAbs().maxCoeff(), 1e-9));
    }
    if (largest < kSolved) {
      load_course();
      return true;
    }
  }
  return false;
}

// Carries w's derivatives over theta along the motion, from the derivatives of the model at all
// points, and adds what they do to the force.
bool MotionIntegrator::carry_slopes() {
  MatrixXd slope(q_, q_), now = MatrixXd::Zero(q_, p_), last = now, before = now, history = now;
  for (int i = 1; i < n_; ++i) {
    const Difference rate = difference_at(i);
    before.swap(last);
    last.swap(now);
    history = rate.last * last + rate.before * before;
    slope_at(all_, i, rate.now, slope);
    for (int d = 0; d < q_; ++d) {
      for (int k = 0; k < p_; ++k) {
        now(d, k) = -all_.g_theta[static_cast<std::size_t>((d + 1) * p_ + k)][i];
        for (int e = 0; e < q_; ++e)
          now(d, k) -= all_.g_v[static_cast<std::size_t>((d + 1) * s_ + e + 1)][i] * history(e, k);
      }
    }
    solve(slope, now);
    if (!now.allFinite()) return false;
    for (int d = 0; d < q_; ++d) {
      const auto c = static_cast<std::size_t>(d + 1);
      slope_.row(i) += all_.g_u[c][i] * now.row(d);
      slope_.row(i) += all_.g_v[c][i] * (rate.now * now.row(d) + history.row(d));
    }
  }
  return true;
}

bool MotionIntegrator::at(std::span<const double> theta, bool slopes) {
  if (q_ > 0) {
    has_course_ = (has_course_ && correct_course(theta)) || integrate(theta);
    if (!has_course_) return false;
  }
  if (!afford(n_) || !all_.evaluate(*model_, n_, theta.data())) return false;
  const double mass = inertia_ ? 0.0 : model_->mass(0, 0);
  for (int i = 0; i < n_; ++i)
    force_[i] = all_.g[0][i] - mass * motion_.a[i];
  if (!slopes) return force_.allFinite();
  for (int k = 0; k < p_; ++k)
    slope_.col(k) = Eigen::Map<const VectorXd>(all_.g_theta[static_cast<std::size_t>(k)], n_);
  if (q_ > 0 && !carry_slopes()) return false;
  return force_.allFinite() && slope_.allFinite();
}

}  // namespace shaker::estimator::diagnosis
