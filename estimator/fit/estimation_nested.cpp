// The nested methods: for every theta the periodic solutions converge first.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/fit/estimation_impl.hpp"

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

// Moves theta and the states by the present step, and solves every run there. Returns false at the
// first run without a solution; `last` and `last_run` say which.
bool Estimator::Impl::solve_after_step(bool damped, SolveReport& last, std::size_t& last_run) {
  theta_saved = fit.theta;
  for (std::size_t r = 0; r < systems.size(); ++r) {
    const auto state = systems[r].state();
    std::copy(state.begin(), state.end(), runs[r].saved.begin());
    systems[r].advance(0.0, delta_full);
  }
  for (std::size_t k = 0; k < fit.theta.size(); ++k)
    fit.theta[k] += delta_full[k];
  for (std::size_t r = 0; r < systems.size(); ++r) {
    last = systems[r].solve(fit.theta);
    last_run = r;
    if (last.status == SolveStatus::converged) continue;
    if (damped) return false;
    const auto report = systems[r].solve_from_rest(fit.theta);
    if (report.status == SolveStatus::converged) continue;
    fit.trouble = fmt::format("run {}: {}", r + 1, report.sentence());
    return false;
  }
  return true;
}

// Returns to the iterate before solve_after_step.
void Estimator::Impl::step_back() {
  fit.theta = theta_saved;
  for (std::size_t r = 0; r < systems.size(); ++r) {
    std::copy(runs[r].saved.begin(), runs[r].saved.end(), systems[r].state().begin());
    systems[r].solve(fit.theta);
  }
  accumulate(systems, false);
}

std::string Estimator::Impl::why_not_converged(const SolveReport& last, std::size_t run) const {
  if (last.status == SolveStatus::converged)
    return fmt::format(
        "no convergence in {} iterations; the last step still changed a parameter by {:.1e} of its "
        "value",
        fit.iterations, relative_step());
  return fmt::format(
      "no convergence in {} iterations: it ends where a better fit would have no periodic "
      "solution; run {} ({:g} Hz): {}",
      fit.iterations, run + 1, runs[run].data.frequency_hz, last.sentence());
}

void Estimator::Impl::fit_nested(const std::vector<double>& start, bool warm, bool damped) {
  const auto end_with = [&](FitStatus status) { fit.status = status; };
  fit.trouble.clear();
  if (!solve_all(warm)) return end_with(FitStatus::no_solution);
  NestedDamping damping{damped ? 1e-4 : 0.0};
  accumulate(systems, false);
  double previous = std::numeric_limits<double>::infinity();
  int at_bottom = 0;
  SolveReport last;
  std::size_t last_run = 0;
  const int most = options.max_iterations * (damped ? kPatience : 1);
  for (int iteration = 1; iteration <= most; ++iteration) {
    fit.iterations = iteration;
    const double before = objective();
    if (!box_step(damping.lambda)) {
      if (!damped) return end_with(FitStatus::undetermined);
      if (!damping.make_regular()) break;
      continue;
    }
    const bool capped = damped && cap_step(start);
    const bool pure = damping.lambda <= kNearlyUndamped && !capped;
    const double step = relative_step();
    const bool solved = solve_after_step(damped, last, last_run);
    if (solved) accumulate(systems, false);
    // At the minimum, rounding decides whether the objective rises or falls. A larger increase is
    // therefore accepted for very short steps, and after some of them the minimum counts as
    // reached. Steps that are short because no solution exists further on do not count.
    const bool bottom = step <= 1e3 * options.tolerance;
    bool accepted = solved;
    if (damped) {
      const double slack = bottom ? 1e-9 : 1e-13;
      accepted = solved && objective() <= before + slack * std::fabs(before) + 1e-300;
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
    if (options.keep_iterates) fit.iterates.push_back(fit.theta);
    // A step that is short because of damping does not prove convergence.
    if (pure && (left_after(step, previous) <= options.tolerance || at_bottom > kEnoughAtBottom))
      return end_with(FitStatus::converged);
    previous = pure ? step : std::numeric_limits<double>::infinity();
  }
  end_with(FitStatus::not_converged);
  fit.trouble = why_not_converged(last, last_run);
}

// Returns true if the (nearly) undamped step promises no gain: a negligible part of the sum of
// squares, or a prediction that hardly moves. Near a fold of the solutions the sensitivities are
// unbounded; all steps are then short although the gradient is not zero. Changes `delta`.
bool Estimator::Impl::nothing_to_gain() {
  if (!box_step(kNearlyUndamped)) return false;
  double gain = 0.0;
  for (std::size_t k = 0; k < free.size(); ++k)
    gain += delta[k] * gradient[k];
  return gain <= std::max(kMinRelativeDecrease * sum_of_squares,
                          options.tolerance * options.tolerance * squares_of_data());
}

double Estimator::Impl::squares_of_data() const {
  double sum = 0.0;
  for (const RunState& run : runs) {
    for (const double c : run.whitened)
      sum += c * c;
    for (std::size_t j = 0; j < run.data.displacement.size(); ++j) {
      const double sample = run.data.sample_weight.empty() ? 1.0 : run.data.sample_weight[j];
      sum += run.inverse_variance * sample * run.data.displacement[j] * run.data.displacement[j];
    }
  }
  return sum;
}

}  // namespace shaker::estimator
