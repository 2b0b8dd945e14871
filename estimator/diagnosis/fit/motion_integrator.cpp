#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostNewton = 15;       // of a step; what takes longer jumps between two kinks
constexpr double kSolved = 1e-7;      // of a coordinate: a move after which its square is left
constexpr int kMostCorrections = 12;  // of a block; step by step it costs about as much as 30
constexpr int kLaps = 2;              // of a cycle: the first forgets how it began
constexpr double kRepeated = 1e-9;    // of a coordinate, from cycle to cycle

// right = slope^-1 right, both with a row for each carried coordinate, row after row; `slope` is
// destroyed. Gauss with row exchanges: the matrices are too small for a library. kSize: their size,
// or 0 for any.
template <int kSize>
void divide(int any_size, double* slope, double* right, int columns) {
  const int q = kSize > 0 ? kSize : any_size;
  for (int d = 0; d < q; ++d) {
    int pivot = d;
    for (int r = d + 1; r < q; ++r) {
      if (std::fabs(slope[r * q + d]) > std::fabs(slope[pivot * q + d])) pivot = r;
    }
    if (pivot != d) {
      std::swap_ranges(slope + d * q, slope + (d + 1) * q, slope + pivot * q);
      std::swap_ranges(right + d * columns, right + (d + 1) * columns, right + pivot * columns);
    }
    for (int r = d + 1; r < q; ++r) {
      const double factor = slope[r * q + d] / slope[d * q + d];
      for (int e = d + 1; e < q; ++e)
        slope[r * q + e] -= factor * slope[d * q + e];
      for (int k = 0; k < columns; ++k)
        right[r * columns + k] -= factor * right[d * columns + k];
    }
  }
  for (int d = q; d-- > 0;) {
    for (int k = 0; k < columns; ++k) {
      double& x = right[d * columns + k];
      for (int e = d + 1; e < q; ++e)
        x -= slope[d * q + e] * right[e * columns + k];
      x /= slope[d * q + d];
    }
  }
}

}  // namespace

bool can_be_carried(const Model& model) {
  if (model.mechanical() != 1) return false;
  for (int c = 1; c < model.coordinates(); ++c) {
    if (model.order(c) > 1) return false;
  }
  return true;
}

MotionIntegrator::MotionIntegrator(const Model& model, Motion motion, bool inertia)
    : model_(&model),
      steps_between_(model.coordinate_in_series() >= 0 ? 2 : 1),
      motion_(steps_between_ == 1 ? std::move(motion) : halved(motion)),
      inertia_(inertia),
      n_(static_cast<int>(motion_.u.size())),
      s_(model.coordinates()),
      p_(model.parameter_count()),
      q_(s_ - 1),
      rows_(motion_.periodic && q_ > 0 ? kLaps * n_ : n_),
      marched_(rows_) {
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
    first_[d] = d + 1 == model.coordinate_in_series() ? motion_.u[0] : model.rest(d + 1);
  }
  one_.shape(model, 1);
  block_.shape(model, kBlock);
  force_.resize(n_ / steps_between_);
  slope_.resize(n_ / steps_between_, p_);
  w_.resize(rows_, q_);
  for (VectorXd* values : {&step_.h, &step_.trial, &step_.trial_h, &step_.move})
    values->resize(q_);
  step_.slope.resize(q_ * q_);
}

// w' = (11 w - 18 w_1 + 9 w_2 - 2 w_3) / 6 dt. The first three steps have fewer before them: their
// differences are of lower orders.
MotionIntegrator::Difference MotionIntegrator::difference_at(int row) const {
  const double rate = 1.0 / motion_.dt;
  if (row == 0) return {};
  if (row == 1) return {rate, -rate};
  if (row == 2) return {1.5 * rate, -2.0 * rate, 0.5 * rate};
  return {11.0 / 6.0 * rate, -3.0 * rate, 1.5 * rate, -1.0 / 3.0 * rate};
}

void MotionIntegrator::load_motion(ModelArrays& arrays, int point, int row) const {
  const Index at = row % n_;
  arrays.u[0][point] = motion_.u[at];
  arrays.v[0][point] = motion_.v[at];
  arrays.a[0][point] = motion_.a[at];
  if (motion_.x.size() > 0) arrays.x[point] = motion_.x[at];
}

// Writes the motion, w and its rate into the block's arrays.
void MotionIntegrator::load(int first, int last) {
  for (int row = first; row < last; ++row)
    load_motion(block_, row - first, row);
  const Difference steady = difference_at(kHistory);
  for (int d = 0; d < q_; ++d) {
    const auto c = static_cast<std::size_t>(d + 1);
    const double* w = w_.col(d).data();
    double *value = block_.u[c], *rate = block_.v[c];
    std::copy(w + first, w + last, value);
    int row = first;
    for (; row < std::min(last, kHistory); ++row) {
      const Difference early = difference_at(row);
      rate[row - first] = early.now * w[row] + early.one * w[std::max(row - 1, 0)] +
                          early.two * w[std::max(row - 2, 0)];
    }
    for (; row < last; ++row)
      rate[row - first] = steady.now * w[row] + steady.one * w[row - 1] + steady.two * w[row - 2] +
                          steady.three * w[row - 3];
  }
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

// The derivative of these equations over w, from the i-th point of the arrays, row after row.
void MotionIntegrator::slope_at(const ModelArrays& arrays, int i, double now, double* slope) const {
  for (int d = 0; d < q_; ++d) {
    for (int e = 0; e < q_; ++e) {
      const auto de = static_cast<std::size_t>((d + 1) * s_ + e + 1);
      slope[d * q_ + e] = arrays.g_u[de][i] + now * arrays.g_v[de][i];
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
  auto& [h, trial, trial_h, move, slope] = step_;
  if (!residual(w, now, history, theta, h)) return false;
  for (int round = 0; round < kMostNewton; ++round) {
    slope_at(one_, 0, now, slope.data());
    move = h;
    solve(slope.data(), move.data(), 1);
    if (!move.allFinite()) return false;
    const double length = move.cwiseAbs().maxCoeff();
    if (length < kSolved * std::max(w.cwiseAbs().maxCoeff(), 1e-9)) {
      w -= move;
      return true;
    }
    bool better = false;
    const double norm = h.norm();
    for (double share = 1.0; share > 1e-4 && !better; share *= 0.5) {
      trial = w - share * move;
      better =
          residual(trial, now, history, theta, trial_h) && (trial_h.norm() < norm || norm < 1e-14);
    }
    if (!better) return length <= 1e-5 * std::max(w.cwiseAbs().maxCoeff(), 1e-9);
    w.swap(trial);
    h.swap(trial_h);
  }
  return false;
}

// The search has a course when all coordinates have.
void MotionIntegrator::begun(int coordinate) {
  begun_.resize(static_cast<std::size_t>(q_), false);
  begun_[static_cast<std::size_t>(coordinate)] = true;
  has_course_ = std::find(begun_.begin(), begun_.end(), false) == begun_.end();
  bends_at_.clear();
}

void MotionIntegrator::begin_from(const MotionIntegrator& other) {
  const int finer = other.rows_ / rows_, coarser = rows_ / other.rows_;
  if (!other.has_course_ || (finer * rows_ != other.rows_ && coarser * other.rows_ != rows_))
    return;
  for (int d = 0; d < q_; ++d) {
    int e = 0;
    while (e < other.q_ && other.model_->coordinate_name(e + 1) != model_->coordinate_name(d + 1))
      ++e;
    if (e == other.q_) continue;
    const auto known = other.w_.col(e);
    for (int row = 0; row < rows_; ++row) {
      if (finer > 0) {
        w_(row, d) = known[finer * row];
        continue;
      }
      const int at = row / coarser;
      const double past = static_cast<double>(row % coarser) / coarser;
      w_(row, d) = known[at] + past * (known[std::min(at + 1, other.rows_ - 1)] - known[at]);
    }
    begun(d);
  }
}

void MotionIntegrator::begin_from(const std::string& coordinate, const VectorXd& cycle) {
  for (int d = 0; d < q_; ++d) {
    if (model_->coordinate_name(d + 1) != coordinate) continue;
    for (int row = 0; row < rows_; ++row) {
      const double place = static_cast<double>(row % n_ * cycle.size()) / n_;
      const auto at = static_cast<Index>(place);
      const double next = cycle[(at + 1) % cycle.size()];
      w_(row, d) = cycle[at] + (place - static_cast<double>(at)) * (next - cycle[at]);
    }
    begun(d);
  }
}

// Dispatches to the sizes that the effects of the catalogue have.
void MotionIntegrator::solve(double* slope, double* right, int columns) const {
  if (q_ == 1) return divide<1>(1, slope, right, columns);
  if (q_ == 2) return divide<2>(2, slope, right, columns);
  divide<0>(q_, slope, right, columns);
}

// Carries w along the motion. Returns false where a step has no solution.
bool MotionIntegrator::march(std::span<const double> theta) {
  w_.row(0) = first_.transpose();  // without a rate: what is memory begins at rest
  marched_ = rows_;
  for (int first = 0, last = 0; first < rows_; first = last) {
    last = std::min(first + kBlock, rows_);
    if (!has_course_) guess(first, last);
    correct(first, last, theta);
    if (first < last && !step_through(first, last, theta)) return false;
    if (!repeats(last)) continue;
    marched_ = last;
    for (int row = last; row < rows_; ++row)
      w_.row(row) = w_.row(row - n_);
    break;
  }
  return true;
}

// A course for a block from nothing: that of the cycle before, else what is in series moves with the
// motion, and what is memory stays.
void MotionIntegrator::guess(int first, int last) {
  for (int row = std::max(first, 1); row < last; ++row) {
    for (int d = 0; d < q_; ++d) {
      const double moved = d + 1 == model_->coordinate_in_series()
                               ? motion_.u[row % n_] - motion_.u[(row - 1) % n_]
                               : 0.0;
      w_(row, d) = row >= n_ ? w_(row - n_, d) : w_(row - 1, d) + moved;
    }
  }
}

// The steps before `last` that make the next rate are those of a cycle before: all that follow are, too.
bool MotionIntegrator::repeats(int last) const {
  if (last < n_ + 2 * kHistory) return false;
  for (int d = 0; d < q_; ++d) {
    const auto w = w_.col(d);
    const double size = std::max(w.head(n_).cwiseAbs().maxCoeff(), 1e-9);
    for (int row = last - kHistory; row < last; ++row) {
      if (!(std::fabs(w[row] - w[row - n_]) < kRepeated * size)) return false;
    }
  }
  return true;
}

bool MotionIntegrator::step_through(int first, int last, std::span<const double> theta) {
  VectorXd w = w_.row(std::max(first - 1, 0)).transpose(), history(q_);
  for (int row = std::max(first, 1); row < last; ++row) {
    const Difference rate = difference_at(row);
    load_motion(one_, 0, row);
    history = rate.one * w;
    if (row > 1) history += rate.two * w_.row(row - 2).transpose();
    if (row > 2) history += rate.three * w_.row(row - 3).transpose();
    if (!solve_step(rate.now, history, theta, w)) return false;
    w_.row(row) = w.transpose();
  }
  return true;
}

// Moves w at the steps of a block by one round of Newton's method: a forward substitution. Sets
// `first` to the first step that still moves. Returns false if a move is not finite.
bool MotionIntegrator::move_all(int& first, int last) {
  const int begin = first;
  moves_.assign(static_cast<std::size_t>(q_) * (1 + kHistory), 0.0);
  double* now = moves_.data();  // the moves of this step and of those before
  double *one = now + q_, *two = one + q_, *three = two + q_;
  for (int row = begin; row < last; ++row) {
    const int i = row - begin;
    const Difference rate = difference_at(row);
    std::swap(three, two);
    std::swap(two, one);
    std::swap(one, now);
    slope_at(block_, i, rate.now, step_.slope.data());
    for (int d = 0; d < q_; ++d) {
      now[d] = -block_.g[static_cast<std::size_t>(d + 1)][i];
      for (int e = 0; e < q_; ++e)
        now[d] -= block_.g_v[static_cast<std::size_t>((d + 1) * s_ + e + 1)][i] *
                  (rate.one * one[e] + rate.two * two[e] + rate.three * three[e]);
    }
    solve(step_.slope.data(), now, 1);
    double move = 0.0, size = 1e-9;
    for (int d = 0; d < q_; ++d) {
      if (!std::isfinite(now[d])) return false;
      w_(row, d) += now[d];
      move = std::max(move, std::fabs(now[d]));
      size = std::max(size, std::fabs(w_(row, d)));
    }
    if (first == row && move < kSolved * size) ++first;
  }
  return true;
}

// The same where one coordinate is carried along.
bool MotionIntegrator::move_one(int& first, int last) {
  const int begin = first;
  const double *g = block_.g[1], *g_u = block_.g_u[3], *g_v = block_.g_v[3];
  double* w = w_.data();
  double one = 0.0, two = 0.0, three = 0.0;  // the moves before
  for (int row = begin; row < last; ++row) {
    const int i = row - begin;
    const Difference rate = difference_at(row);
    const double now = (-g[i] - g_v[i] * (rate.one * one + rate.two * two + rate.three * three)) /
                       (g_u[i] + rate.now * g_v[i]);
    if (!std::isfinite(now)) return false;
    w[row] += now;
    if (first == row && std::fabs(now) < kSolved * std::max(1e-9, std::fabs(w[row]))) ++first;
    three = two;
    two = one;
    one = now;
  }
  return true;
}

// Newton for all steps of a block, from the present course: nearby parameters have a nearby course.
// The points are evaluated together, which costs a small part of what they cost one by one. Steps
// settle one after the other; `first` becomes the first that has not, or `last`. From there on w is
// then undefined.
void MotionIntegrator::correct(int& first, int last, std::span<const double> theta) {
  first = std::max(first, 1);
  for (int round = 0; round < kMostCorrections && first < last; ++round) {
    load(first, last);
    if (!afford(last - first) || !block_.evaluate_internal(*model_, last - first, theta.data()))
      return;
    if (!(q_ == 1 ? move_one(first, last) : move_all(first, last))) return;
  }
}

bool MotionIntegrator::at(std::span<const double> theta, bool slopes) {
  if (has_course_) predict(theta);
  bends_at_.clear();
  has_course_ = q_ == 0 || march(theta);
  if (!has_course_ || !follow(theta, slopes)) return false;
  if (slopes && q_ > 0) bends_at_.assign(theta.begin(), theta.end());
  return true;
}

}  // namespace shaker::estimator::diagnosis
