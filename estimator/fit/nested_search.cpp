#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/fit/searches.hpp"
#include "estimator/periodic/newton_rate.hpp"

namespace shaker::estimator {
namespace {

constexpr double kNearlyUndamped = 1e-5;
constexpr int kEnoughAtBottom = 8;
constexpr double kMinRelativeDecrease = 1e-6;  // of the sum of squares
// Factor on the iterations of the damped method. It follows a curved valley, along which two
// parameters can hardly be told apart (figure 13), in hundreds of short steps. Full Gauss-Newton
// steps converge soon or never.
constexpr int kPatience = 8;

// Damping of the nested steps: refused steps raise it faster and faster.
struct NestedDamping {
  double lambda, grow = 2.0;

  // After a singular matrix and after a refused step. False: more would not help.
  bool make_regular() { return (lambda = std::max(4.0 * lambda, 1e-10)) <= 1e8; }
  bool raise() {
    lambda = std::max(lambda, 1e-12) * grow;
    grow *= 2.0;
    return lambda <= 1e12;
  }
  void lower() {
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

void NestedSearch::run(const std::vector<double>& start, bool warm, bool damped) {
  const auto end_with = [&](FitStatus status) { fit.status = status; };
  fit.trouble = solutions.solve_all(fit.theta, warm);
  if (!fit.trouble.empty()) return end_with(FitStatus::no_solution);
  NestedDamping damping{damped ? 1e-4 : 0.0};
  accumulate();
  double previous = std::numeric_limits<double>::infinity();
  int at_bottom = 0;
  last_ = {};
  last_run_ = 0;
  const int most = data.options.max_iterations * (damped ? kPatience : 1);
  for (int iteration = 1; iteration <= most; ++iteration) {
    fit.iterations = iteration;
    const double before = equations.objective(fit.theta);
    if (!equations.step(fit.theta, damping.lambda)) {
      if (!damped) return end_with(FitStatus::undetermined);
      if (!damping.make_regular()) break;
      continue;
    }
    const bool capped = damped && equations.cap_step(fit.theta, start);
    const bool pure = damping.lambda <= kNearlyUndamped && !capped;
    const double step = equations.relative_step(fit.theta);
    const bool solved = solve_after_step(damped);
    if (solved) accumulate();
    // At the minimum, rounding decides whether the objective rises or falls. A larger increase is
    // therefore accepted for very short steps, and after some of them the minimum counts as
    // reached. Steps that are short because no solution exists further on do not count.
    const bool bottom = step <= 1e3 * data.options.tolerance;
    bool accepted = solved;
    if (damped) {
      const double slack = bottom ? 1e-9 : 1e-13;
      accepted =
          solved && equations.objective(fit.theta) <= before + slack * std::fabs(before) + 1e-300;
      at_bottom = bottom && solved ? at_bottom + 1 : 0;
    }
    if (!accepted) {
      if (!damped) return end_with(FitStatus::no_solution);
      step_back();
      if (at_bottom > kEnoughAtBottom && nothing_to_gain()) return end_with(FitStatus::converged);
      if (!damping.raise()) break;
      continue;
    }
    damping.lower();
    if (data.options.keep_iterates) fit.iterates.push_back(fit.theta);
    // A step that is short because of damping does not prove convergence.
    if (pure &&
        (left_after(step, previous) <= data.options.tolerance || at_bottom > kEnoughAtBottom))
      return end_with(FitStatus::converged);
    previous = pure ? step : std::numeric_limits<double>::infinity();
  }
  end_with(FitStatus::not_converged);
  fit.trouble = why_not_converged();
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
