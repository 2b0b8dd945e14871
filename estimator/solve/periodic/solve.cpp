// Whole periodic solutions: static equilibrium, continuation in the amplitude, damped Newton.
#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {
namespace {

constexpr double kSmallestDamping = 1.0 / 1024;
constexpr int kMostFollowed = 8;  // coordinates with a size of their own; further ones share
constexpr double kClose = 1e-4;   // of the state: the largest Newton step that may end a search

// Uses four independent maxima because each maximum waits for the previous one.
double largest(const double* values, std::size_t count, std::size_t stride) {
  double worst[4] = {};
  for (std::size_t i = 0; i < count; ++i)
    worst[i % 4] = std::max(worst[i % 4], std::fabs(values[i * stride]));
  return std::max(std::max(worst[0], worst[1]), std::max(worst[2], worst[3]));
}

}  // namespace

// Halves the Newton step until the state is admissible and the residual is smaller. Returns the
// accepted share of the step, or 0 if none was accepted. The system is linearised at the resulting
// state.
double PeriodicSystem::damped_step(std::span<const double> theta) {
  saved_.assign(z_.begin(), z_.end());
  const double before = residual_;
  for (double damping = 1.0; damping >= kSmallestDamping; damping *= 0.5) {
    for (int i = 0; i < n_ * s_; ++i)
      z_[i] = saved_[i] + damping * rows_[static_cast<std::size_t>(i) * stride_];
    if (linearise(theta) && residual_ < (1.0 - 0.1 * damping) * before) return damping;
  }
  z_.assign(saved_.begin(), saved_.end());
  linearise(theta);
  return 0.0;
}

SolveReport PeriodicSystem::solve(std::span<const double> theta, int max_iterations,
                                  double tolerance) {
  SolveReport report;
  if (!linearise(theta)) {
    report.status = SolveStatus::inadmissible;
    return report;
  }
  for (report.iterations = 0; report.iterations < max_iterations; ++report.iterations) {
    const std::size_t count = z_.size();
    const double size = std::max(1e-300, largest(z_.data(), count, 1));
    // The smallest residual that rounding allows: differences of z scaled by (f n)^2.
    const double floor = 64.0 * 2.3e-16 * size * frequency_ * frequency_ * n_ * n_;
    const bool may_end = residual_ <= std::max(tolerance, floor);
    if (!solve_rows(may_end)) {
      report.status = SolveStatus::singular;
      report.residual = residual_;
      return report;
    }
    report.residual = residual_;
    const double step = largest(rows_.data(), count, static_cast<std::size_t>(stride_));
    // A residual at the rounding level does not prove convergence where the equations depend only
    // weakly on the state (the spacing of doubles at a stroke of 1e11 m exceeds the effect of
    // gravity). The step must be small too.
    if (residual_ <= tolerance || (residual_ <= floor && step <= kClose * size)) {
      if (!observe()) report.status = SolveStatus::singular;
      return report;
    }
    if (damped_step(theta) == 0.0) {
      // No share of the step reduces the residual: with a tiny step this is convergence.
      report.residual = residual_;
      report.step_left = step / std::max(size, 1e-3);
      solve_step();
      report.status =
          report.step_left < 1e-9 ? SolveStatus::converged : SolveStatus::no_convergence;
      return report;
    }
  }
  report.residual = residual_;
  const bool arrived = residual_ <= tolerance && solve_step();  // by the last step that was allowed
  report.status = arrived ? SolveStatus::converged : SolveStatus::no_convergence;
  return report;
}

bool PeriodicSystem::follow_observed(std::span<const double> theta) {
  constexpr int kMostSteps = 8;
  constexpr double kEnough = 1e-2;  // of the state
  if (s_ == 1) return true;
  const int held = model_->observed();
  for (int i = 0; i < n_ * s_; ++i) {
    if (i % s_ != held) z_[i] = model_->rest(i % s_);
  }
  begin();
  for (int step = 0; step < kMostSteps; ++step) {
    if (!linearise(theta)) return false;
    // "It does not move" replaces the equation of the observed coordinate.
    std::fill_n(g_[held], n_, 0.0);
    for (int e = 0; e < s_; ++e) {
      std::fill_n(g_u_[held * s_ + e], n_, e == held ? 1.0 : 0.0);
      std::fill_n(g_v_[held * s_ + e], n_, 0.0);
      std::fill_n(g_a_[held * s_ + e], n_, 0.0);
    }
    if (!solve_rows(false)) return false;
    double moved[kMostFollowed] = {}, size[kMostFollowed] = {};
    for (int i = 0; i < n_ * s_; ++i) {
      const int c = std::min(i % s_, kMostFollowed - 1);
      const double change = i % s_ == held ? 0.0 : rows_[static_cast<std::size_t>(i) * stride_];
      z_[i] += change;
      moved[c] = std::max(moved[c], std::fabs(change));
      size[c] = std::max(size[c], std::fabs(z_[i]));
    }
    bool arrived = true;
    for (int c = 0; c < kMostFollowed; ++c)
      arrived = arrived && moved[c] <= kEnough * size[c];
    if (arrived) return true;
  }
  return false;
}

// Evaluates the model at rest at the first point's state. All points of a constant solution are
// equal, so the equations of one point suffice.
bool PeriodicSystem::evaluate_at_rest(std::span<const double> theta) {
  if (store_.empty()) take_memory();
  for (int c = 0; c < s_; ++c) {
    std::fill_n(u_[c], kLanes, z_[c]);  // admissible values in the padding too
    std::fill_n(v_[c], kLanes, 0.0);
    std::fill_n(a_[c], kLanes, 0.0);
  }
  ModelPoints points = model_points();
  points.n = 1;
  const ModelForces forces{g_.data(),   g_u_.data(),     g_v_.data(),
                           g_a_.data(), g_theta_.data(), scratch_.data()};
  if (!model_->evaluate(points, theta.data(), forces)) return false;
  residual_ = 0.0;
  for (int d = 0; d < s_; ++d)
    residual_ = std::max(residual_, std::fabs(g_[d][0]));
  return std::isfinite(residual_);
}

// Computes the Newton step of the equations at rest.
void PeriodicSystem::step_at_rest(std::span<double> step) const {
  if (s_ == 1) {
    step[0] = g_u_[0][0] != 0.0 ? -g_[0][0] / g_u_[0][0] : 0.0;
    return;
  }
  Eigen::MatrixXd slope(s_, s_);
  Eigen::VectorXd right(s_);
  for (int d = 0; d < s_; ++d) {
    right[d] = -g_[d][0];
    for (int e = 0; e < s_; ++e)
      slope(d, e) = g_u_[d * s_ + e][0];
  }
  const Eigen::VectorXd solution = least_squares(slope, right);
  std::copy(solution.begin(), solution.end(), step.begin());
}

// Solves for the constant solution by damped Newton.
bool PeriodicSystem::equilibrium(std::span<const double> theta) {
  begin();
  for (int c = 0; c < s_; ++c)
    z_[c] = model_->rest(c);
  set_share(0.0);
  if (!evaluate_at_rest(theta)) return false;
  std::vector<double> step(static_cast<std::size_t>(s_));
  for (int iteration = 0; iteration < 100 && residual_ >= 1e-10; ++iteration) {
    step_at_rest(step);
    if (!std::all_of(step.begin(), step.end(), [](double d) { return std::isfinite(d); }))
      return false;
    saved_.assign(z_.begin(), z_.begin() + s_);
    const double before = residual_;
    double damping = 1.0;
    for (; damping > 1e-9; damping *= 0.5) {
      for (int c = 0; c < s_; ++c)
        z_[c] = saved_[c] + damping * step[c];
      if (evaluate_at_rest(theta) && residual_ < before) break;
    }
    if (damping <= 1e-9) {
      residual_ = before;
      break;
    }
  }
  for (int i = s_; i < n_ * s_; ++i)
    z_[i] = z_[i - s_];
  return residual_ < 1e-6;
}

SolveReport PeriodicSystem::solve_from_rest(std::span<const double> theta, double tolerance,
                                            int most) {
  SolveReport report;
  if (!equilibrium(theta)) {
    report.status = SolveStatus::no_equilibrium;
    report.amplitude_reached = 0.0;
    set_share(1.0);
    return report;
  }
  // The excitation grows in steps that double after an easy success and halve after a failure.
  AlignedVector good(z_.begin(), z_.end());
  double reached = 0.0;
  double step = 1.0;
  int iterations = 0;
  while (reached < 1.0 && iterations < most) {
    const double target = std::min(1.0, reached + step);
    set_share(target);
    report = solve(theta, target < 1.0 ? 12 : 30, tolerance);
    iterations += report.iterations;
    if (report.status == SolveStatus::converged) {
      reached = target;
      good.assign(z_.begin(), z_.end());
      if (report.iterations < 6) step *= 2.0;
    } else {
      z_.assign(good.begin(), good.end());
      step *= 0.5;
      if (step < 1e-4) break;
    }
  }
  set_share(1.0);
  report.iterations = iterations;
  report.amplitude_reached = reached;
  if (reached < 1.0) report.status = SolveStatus::no_convergence;
  return report;
}

}  // namespace shaker::estimator
