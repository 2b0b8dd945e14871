#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/fit/internal/searches.hpp"
#include "estimator/math/damped_minimum.hpp"
#include "estimator/solve/periodic/newton_rate.hpp"

namespace shaker::estimator {
namespace {

constexpr double kNearlyUndamped = 1e-5;
constexpr double kFirstLambda = 1e-4;
constexpr int kEnoughAtBottom = 8;
constexpr double kMinRelativeDecrease = 1e-6;  // of the sum of squares
// Factor on the iterations of the damped method. It follows a curved valley, along which two
// parameters can hardly be told apart (figure 13), in hundreds of short steps. Full Gauss-Newton
// steps converge soon or never.
constexpr int kPatience = 8;

// Refused steps raise the damping faster and faster.
struct NestedDamping {
  double lambda, grow = 2.0;

  bool raise_after_invalid_step() { return (lambda = std::max(4.0 * lambda, 1e-10)) <= 1e8; }
  bool raise_after_failure() {
    lambda = std::max(lambda, 1e-12) * grow;
    grow *= 2.0;
    return lambda <= 1e12;
  }
  void lower_after_success() {
    grow = 2.0;
    lambda /= 8.0;
  }
};

}  // namespace

NestedSearch::NestedSearch(const Search& search) : Search(search) {}

// Moves theta and the states by the present step, and solves every run there. Returns false at the
// first run without a solution.
bool NestedSearch::solve_after_step(bool damped) {
  std::vector<PeriodicSystem>& systems = solutions.systems;
  theta_before_ = fit.theta;
  states_before_.resize(systems.size());
  for (std::size_t r = 0; r < systems.size(); ++r) {
    const auto state = systems[r].state();
    states_before_[r].assign(state.begin(), state.end());
    systems[r].advance(0.0, equations.delta_full);
  }
  move_theta();
  for (std::size_t r = 0; r < systems.size(); ++r) {
    last_ = systems[r].solve(fit.theta);
    last_run_ = r;
    if (last_.status == SolveStatus::converged) continue;
    if (damped) return false;
    const auto report = systems[r].solve_from_rest(fit.theta);
    if (report.status == SolveStatus::converged) continue;
    fit.trouble = fmt::format("run {}: {}", r + 1, report.sentence());
    return false;
  }
  return true;
}

// Returns to the iterate before solve_after_step.
void NestedSearch::step_back() {
  std::vector<PeriodicSystem>& systems = solutions.systems;
  fit.theta = theta_before_;
  for (std::size_t r = 0; r < systems.size(); ++r) {
    std::copy(states_before_[r].begin(), states_before_[r].end(), systems[r].state().begin());
    systems[r].solve(fit.theta);
  }
  accumulate();
}

std::string NestedSearch::why_not_converged() const {
  if (last_.status == SolveStatus::converged)
    return fmt::format(
        "no convergence in {} iterations; the last step still changed a parameter by {:.1e} of its "
        "value",
        fit.iterations, equations.relative_step(fit.theta));
  return fmt::format(
      "no convergence in {} iterations: it ends where a better fit would have no periodic "
      "solution; run {} ({:g} Hz): {}",
      fit.iterations, last_run_ + 1, data.runs[last_run_].data.frequency_hz, last_.sentence());
}

bool NestedSearch::compute_step(double lambda) {
  ++fit.iterations;
  trial_.before = equations.objective(fit.theta);
  if (!equations.step(fit.theta, lambda)) return false;
  const bool capped = damped_ && equations.cap_step(fit.theta, start_);
  trial_.pure = lambda <= kNearlyUndamped && !capped;
  trial_.size = equations.relative_step(fit.theta);
  return true;
}

// At the minimum, rounding decides whether the objective rises or falls. A larger increase is
// therefore accepted for very short steps, and after some of them the minimum counts as reached.
// Steps that are short because no solution exists further on do not count.
bool NestedSearch::step_is_successful() {
  const bool solved = solve_after_step(damped_);
  if (solved) accumulate();
  if (!damped_) return solved;
  const bool bottom = trial_.size <= 1e3 * data.options.tolerance;
  const double slack = bottom ? 1e-9 : 1e-13;
  at_bottom_ = bottom && solved ? at_bottom_ + 1 : 0;
  if (solved &&
      equations.objective(fit.theta) <= trial_.before + slack * std::fabs(trial_.before) + 1e-300)
    return true;
  step_back();
  return false;
}

// A step that is short because of damping does not prove convergence.
bool NestedSearch::converged_after_success() {
  if (data.options.keep_iterates) fit.iterates.push_back(fit.theta);
  const double before = previous_;
  previous_ = trial_.pure ? trial_.size : std::numeric_limits<double>::infinity();
  return trial_.pure && (left_after(trial_.size, before) <= data.options.tolerance ||
                         at_bottom_ > kEnoughAtBottom);
}

bool NestedSearch::converged_after_failure() {
  return damped_ && at_bottom_ > kEnoughAtBottom && nothing_to_gain();
}

void NestedSearch::run(const std::vector<double>& start, bool warm, bool damped) {
  fit.trouble = solutions.solve_all(fit.theta, warm);
  fit.status = FitStatus::no_solution;
  if (!fit.trouble.empty()) return;
  accumulate();
  start_ = start;
  damped_ = damped;
  previous_ = std::numeric_limits<double>::infinity();
  at_bottom_ = 0;
  last_ = {};
  last_run_ = 0;
  fit.iterations = 0;
  NestedDamping damping{kFirstLambda};
  NoDamping none;
  const int most = data.options.max_iterations;
  const LoopEnd end = damped ? minimise_damped(*this, damping, kPatience * most)
                             : minimise_damped(*this, none, most);
  if (end == LoopEnd::converged) {
    fit.status = FitStatus::converged;
  } else if (!damped && end == LoopEnd::invalid_step) {
    fit.status = FitStatus::undetermined;
  } else if (damped || end == LoopEnd::too_many_iterations) {
    fit.status = FitStatus::not_converged;
    fit.trouble = why_not_converged();
  }
}

// Returns true if the (nearly) undamped step promises no gain: a negligible part of the sum of
// squares, or a prediction that hardly moves. Near a fold of the solutions the sensitivities are
// unbounded; all steps are then short although the gradient is not zero. Changes the step.
bool NestedSearch::nothing_to_gain() {
  if (!equations.step(fit.theta, kNearlyUndamped)) return false;
  double gain = 0.0;
  for (std::size_t k = 0; k < data.free.size(); ++k)
    gain += equations.delta[k] * equations.gradient[k];
  return gain <= std::max(kMinRelativeDecrease * equations.sum_of_squares,
                          data.options.tolerance * data.options.tolerance * data.squares());
}

}  // namespace shaker::estimator
