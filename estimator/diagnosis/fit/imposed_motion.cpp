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
constexpr double kDifference = 1e-4;  // of the motion, for slopes over it

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
  const VectorXd rate = derivative(motion, frequency_);
  const VectorXd acceleration = derivative(rate, frequency_);
  u_ = synthesised(motion, n_);
  v_ = synthesised(rate, n_);
  a_ = synthesised(acceleration, n_);
  force_.resize(n_);
  slope_.resize(n_, p_);
  if (model.coordinate_in_series() >= 0) {
    integrator_ = std::make_unique<MotionIntegrator>(
        model, Motion{1.0 / (frequency_ * n_), u_, v_, a_, VectorXd(), true}, false);
    return;
  }
  at_.shape(model, n_);
  std::copy(u_.begin(), u_.end(), at_.u[0]);
  std::copy(v_.begin(), v_.end(), at_.v[0]);
  std::copy(a_.begin(), a_.end(), at_.a[0]);
  if (memory_ == 0) return;
  ring_.emplace(model, frequency_, n_);
  rest_.resize(n_, memory_);
  for (int d = 0; d < memory_; ++d)
    rest_.col(d).setConstant(model.rest(1 + d));
}

bool ImposedMotion::evaluate(std::span<const double> theta) {
  if (ring_) ring_->differentiate(at_);
  return at_.evaluate(*model_, n_, theta.data());
}

double ImposedMotion::row_norm() const {
  double sum = 0.0;
  for (int c = 1; c < s_; ++c)
    sum += Eigen::Map<const VectorXd>(at_.g[static_cast<std::size_t>(c)], n_).squaredNorm();
  return std::sqrt(sum / n_);
}

void ImposedMotion::put_memory(const MatrixXd& memory) {
  for (int d = 0; d < memory_; ++d)
    std::copy_n(memory.col(d).data(), n_, at_.u[static_cast<std::size_t>(1 + d)]);
}

// Moves the memories from the last solution along its derivatives. Returns false if they are not
// known, or theta is the same.
bool ImposedMotion::predict_memory(std::span<const double> theta) {
  if (solved_at_.empty() || std::equal(theta.begin(), theta.end(), solved_at_.begin()))
    return false;
  const auto by = Eigen::Map<const VectorXd>(theta.data(), p_) -
                  Eigen::Map<const VectorXd>(solved_at_.data(), p_);
  for (int d = 0; d < memory_; ++d)
    Eigen::Map<VectorXd>(at_.u[static_cast<std::size_t>(1 + d)], n_) =
        solved_.col(d) + over_theta_.middleCols(d * p_, p_) * by;
  return true;
}

// Damped Newton on the memory.
bool ImposedMotion::converge(std::span<const double> theta) {
  if (!evaluate(theta)) return false;
  for (int step = 0; step < kMaxMotionSteps; ++step) {
    if (!ring_->solve(at_)) return false;
    trial_.resize(n_, memory_);
    double largest = 0.0, size = 1e-300;
    for (int d = 0; d < memory_; ++d) {
      trial_.col(d) = Eigen::Map<const VectorXd>(at_.u[static_cast<std::size_t>(1 + d)], n_);
      size = std::max(size, trial_.col(d).cwiseAbs().maxCoeff());
      for (int i = 0; i < n_; ++i)
        largest = std::max(largest, std::fabs(ring_->row(i, d)[0]));
    }
    if (!std::isfinite(largest)) return false;
    if (largest < 1e-9 * std::max(size, 1e-9)) return true;
    const double before = row_norm();
    bool better = false;
    for (double share = 1.0; share > 1e-3 && !better; share *= 0.5) {
      for (int d = 0; d < memory_; ++d) {
        double* w = at_.u[static_cast<std::size_t>(1 + d)];
        for (int i = 0; i < n_; ++i)
          w[i] = trial_(i, d) + share * ring_->row(i, d)[0];
      }
      better = evaluate(theta) && row_norm() < (1.0 - 0.1 * share) * before;
    }
    if (!better) return largest < 1e-6 * std::max(size, 1e-9);
  }
  return false;
}

bool ImposedMotion::solve_memory(std::span<const double> theta) {
  const bool known = solved_.size() > 0;
  bool found = predict_memory(theta) && converge(theta);
  if (!found) {
    put_memory(known ? solved_ : rest_);
    found = converge(theta);
  }
  if (!found && known && solved_at_.empty()) {
    put_memory(rest_);
    found = converge(theta);
  }
  if (!found) return false;
  solved_at_.assign(theta.begin(), theta.end());
  solved_.resize(n_, memory_);
  over_theta_.resize(n_, memory_ * p_);
  for (int d = 0; d < memory_; ++d) {
    solved_.col(d) = Eigen::Map<const VectorXd>(at_.u[static_cast<std::size_t>(1 + d)], n_);
    for (int i = 0; i < n_; ++i) {
      for (int k = 0; k < p_; ++k)
        over_theta_(i, d * p_ + k) = ring_->row(i, d)[1 + k];
    }
  }
  return true;
}

bool ImposedMotion::at(std::span<const double> theta, bool slopes) {
  theta_.assign(theta.begin(), theta.end());
  if (integrator_) {
    if (!integrator_->at(theta, slopes)) return false;
    force_ = integrator_->force();
    if (slopes) slope_ = integrator_->slope();
    return true;
  }
  if (memory_ > 0 ? !solve_memory(theta) : !evaluate(theta)) return false;
  force_ = Eigen::Map<const VectorXd>(at_.g[0], n_) - model_->mass(0, 0) * a_;
  if (!slopes) return force_.allFinite();
  for (int k = 0; k < p_; ++k)
    slope_.col(k) = Eigen::Map<const VectorXd>(at_.g_theta[static_cast<std::size_t>(k)], n_);
  for (int d = 0; d < memory_; ++d) {
    const auto e = static_cast<std::size_t>(1 + d);
    ring_->add_to_slope(d, at_.g_u[e], at_.g_v[e], slope_);
  }
  return force_.allFinite() && slope_.allFinite();
}

void ImposedMotion::start_from(const ImposedMotion& other) {
  if (integrator_ && other.integrator_) integrator_->begin_from(*other.integrator_);
  for (int e = 0; integrator_ && e < other.solved_.cols(); ++e)
    integrator_->begin_from(other.model_->coordinate_name(1 + e), other.solved_.col(e));
  if (!ring_ || other.solved_.size() == 0) return;
  bool any = false;
  MatrixXd start = solved_.size() > 0 ? solved_ : rest_;
  for (int d = 0; d < memory_; ++d) {
    for (int e = 0; e < other.memory_; ++e) {
      if (model_->coordinate_name(1 + d) != other.model_->coordinate_name(1 + e)) continue;
      any = true;
      for (int i = 0; i < n_; ++i) {
        const double place = static_cast<double>(i) * other.n_ / n_;
        const int at = static_cast<int>(place);
        const double last = other.solved_(at, e);
        start(i, d) = last + (place - at) * (other.solved_((at + 1) % other.n_, e) - last);
      }
    }
  }
  if (!any) return;
  solved_ = std::move(start);
  solved_at_.clear();
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
