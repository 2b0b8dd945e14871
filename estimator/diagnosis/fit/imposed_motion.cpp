#include "estimator/diagnosis/fit/internal/imposed_motion.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMaxMotionSteps = 60;
constexpr double kDifference = 1e-4;    // of the motion, for slopes over it
constexpr int kStepsBetweenPoints = 2;  // steps of an integration between two points

}  // namespace

ImposedMotion::ImposedMotion(const Model& model, double frequency_hz, const VectorXd& motion,
                             int points)
    : model_(&model),
      n_(points),
      s_(model.coordinates()),
      p_(model.parameter_count()),
      memory_(s_ - model.mechanical()),
      frequency_(frequency_hz),
      motion_(motion) {
  if (model.mechanical() != 1)
    throw std::invalid_argument(
        fmt::format("{}: a motion can only be imposed on a model of one coordinate", model.name()));
  const Eigen::MatrixXd table = synthesis_matrix(static_cast<int>((motion.size() - 1) / 2), n_);
  const VectorXd rate = derivative(motion, frequency_);
  u_ = table * motion;
  v_ = table * rate;
  a_ = table * derivative(rate, frequency_);
  force_.resize(n_);
  slope_.resize(n_, p_);
  if (parts_in_series(model)) {
    const MatrixXd fine =
        synthesis_matrix(static_cast<int>((motion.size() - 1) / 2), kStepsBetweenPoints * n_);
    integrator_ = std::make_unique<MotionIntegrator>(
        model,
        Motion{1.0 / (frequency_ * kStepsBetweenPoints * n_), fine * motion, fine * rate,
               fine * derivative(rate, frequency_), VectorXd(), true},
        false);
    return;
  }
  at_.shape(model, n_);
  std::copy(u_.begin(), u_.end(), at_.u[0]);
  std::copy(v_.begin(), v_.end(), at_.v[0]);
  std::copy(a_.begin(), a_.end(), at_.a[0]);
  for (int c = 1; c < s_; ++c)
    std::fill_n(at_.u[static_cast<std::size_t>(c)], n_, model.rest(c));
  if (memory_ == 0) return;
  band_.emplace(n_, memory_, stencil_.reach);
  rows_.resize(static_cast<std::size_t>(n_ * memory_ * (1 + p_)));
}

double ImposedMotion::difference(const double* column, int i) const {
  double sum = 0.0;
  for (int k = -stencil_.reach; k <= stencil_.reach; ++k)
    sum += stencil_.first[static_cast<std::size_t>(k + stencil_.reach)] * column[(i + k + n_) % n_];
  return sum * frequency_ * n_;
}

void ImposedMotion::differentiate() {
  for (int c = 1; c < s_; ++c) {
    const auto at = static_cast<std::size_t>(c);
    for (int i = 0; i < n_; ++i)
      at_.v[at][i] = difference(at_.u[at], i);
  }
}

bool ImposedMotion::evaluate(std::span<const double> theta) {
  differentiate();
  return at_.evaluate(*model_, n_, theta.data());
}

double ImposedMotion::row_norm() const {
  double sum = 0.0;
  for (int c = 1; c < s_; ++c) {
    for (int i = 0; i < n_; ++i)
      sum += std::pow(at_.g[static_cast<std::size_t>(c)][i], 2);
  }
  return std::sqrt(sum / n_);
}

bool ImposedMotion::factorise() {
  band_->clear();
  for (int i = 0; i < n_; ++i) {
    for (int d = 1; d < s_; ++d) {
      for (int e = 1; e < s_; ++e) {
        const auto de = static_cast<std::size_t>(d * s_ + e);
        const double over_v = at_.g_v[de][i] * frequency_ * n_;
        double values[kMostAcross];
        for (std::size_t k = 0; k < std::size(values); ++k)
          values[k] = over_v * stencil_.first[k];
        values[stencil_.reach] += at_.g_u[de][i];
        band_->add(i, d - 1, e - 1, values);
      }
    }
  }
  return band_->factorise();
}

// Damped Newton on the memory; its course over theta stays in `rows_`.
bool ImposedMotion::solve_memory(std::span<const double> theta) {
  const int stride = 1 + p_;
  if (!evaluate(theta)) return false;
  for (int step = 0; step < kMaxMotionSteps; ++step) {
    if (!factorise()) return false;
    for (int i = 0; i < n_; ++i) {
      for (int d = 1; d < s_; ++d) {
        double* row = &rows_[static_cast<std::size_t>((i * memory_ + d - 1) * stride)];
        row[0] = -at_.g[static_cast<std::size_t>(d)][i];
        for (int k = 0; k < p_; ++k)
          row[1 + k] = -at_.g_theta[static_cast<std::size_t>(d * p_ + k)][i];
      }
    }
    band_->solve(rows_.data(), stride, stride);
    double largest = 0.0, size = 1e-300;
    std::vector<std::vector<double>> kept;
    for (int c = 1; c < s_; ++c) {
      const double* column = at_.u[static_cast<std::size_t>(c)];
      kept.emplace_back(column, column + n_);
      for (int i = 0; i < n_; ++i) {
        largest = std::max(
            largest, std::fabs(rows_[static_cast<std::size_t>((i * memory_ + c - 1) * stride)]));
        size = std::max(size, std::fabs(column[i]));
      }
    }
    if (!std::isfinite(largest)) return false;
    if (largest < 1e-9 * std::max(size, 1e-9)) return true;
    const double before = row_norm();
    bool better = false;
    for (double share = 1.0; share > 1e-3 && !better; share *= 0.5) {
      for (int c = 1; c < s_; ++c) {
        for (int i = 0; i < n_; ++i)
          at_.u[static_cast<std::size_t>(c)][i] =
              kept[static_cast<std::size_t>(c - 1)][static_cast<std::size_t>(i)] +
              share * rows_[static_cast<std::size_t>((i * memory_ + c - 1) * stride)];
      }
      better = evaluate(theta) && row_norm() < (1.0 - 0.1 * share) * before;
    }
    if (!better) return largest < 1e-6 * std::max(size, 1e-9);
  }
  return false;
}

bool ImposedMotion::at(std::span<const double> theta, bool slopes) {
  theta_.assign(theta.begin(), theta.end());
  if (integrator_) {
    if (!integrator_->at(theta, slopes)) return false;
    for (int i = 0; i < n_; ++i) {
      force_[i] = integrator_->force()[kStepsBetweenPoints * i];
      if (slopes) slope_.row(i) = integrator_->slope().row(kStepsBetweenPoints * i);
    }
    return true;
  }
  if (memory_ > 0 ? !solve_memory(theta) : !evaluate(theta)) return false;
  for (int i = 0; i < n_; ++i)
    force_[i] = at_.g[0][i] - model_->mass(0, 0) * a_[i];
  if (!slopes) return force_.allFinite();
  for (int i = 0; i < n_; ++i) {
    for (int k = 0; k < p_; ++k)
      slope_(i, k) = at_.g_theta[static_cast<std::size_t>(k)][i];
  }
  std::vector<double> column(static_cast<std::size_t>(n_));
  for (int e = 1; e < s_; ++e) {
    for (int k = 0; k < p_; ++k) {
      for (int i = 0; i < n_; ++i)
        column[static_cast<std::size_t>(i)] =
            rows_[static_cast<std::size_t>((i * memory_ + e - 1) * (1 + p_) + 1 + k)];
      for (int i = 0; i < n_; ++i)
        slope_(i, k) +=
            at_.g_u[static_cast<std::size_t>(e)][i] * column[static_cast<std::size_t>(i)] +
            at_.g_v[static_cast<std::size_t>(e)][i] * difference(column.data(), i);
    }
  }
  return force_.allFinite() && slope_.allFinite();
}

void ImposedMotion::start_from(const ImposedMotion& other) {
  if (integrator_ && other.integrator_) integrator_->begin_from(*other.integrator_);
}

MatrixXd ImposedMotion::over_motion() const {
  const double h = kDifference * motion_.tail(motion_.size() - 1).norm();
  MatrixXd slope = MatrixXd::Zero(n_, motion_.size());
  for (Index c = 0; c < motion_.size(); ++c) {
    VectorXd more = motion_, less = motion_;
    more[c] += h;
    less[c] -= h;
    ImposedMotion high(*model_, frequency_, more, n_), low(*model_, frequency_, less, n_);
    high.start_from(*this);
    low.start_from(*this);
    if (high.at(theta_, false) && low.at(theta_, false))
      slope.col(c) = (high.force() - low.force()) / (2.0 * h);
  }
  return slope;
}

}  // namespace shaker::estimator::diagnosis
