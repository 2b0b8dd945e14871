// Selection of the periodic solution to fit: the branch of solutions that the rig was on.
//
// One excitation may have several solutions, for example a hardening spring in its bistable range.
// A solution computed from rest then lies on the lower branch, whatever branch the rig was on. If a
// fit from rest stays far from the data, it is repeated from the data's own harmonics. Its
// parameters may then come from the equation error: they minimise the residual (5.15) of the
// measured motion, which needs no solution and therefore depends on no branch. The final fit is
// checked: a warning names an unstable solution, or one beside which a better branch exists.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/fit/internal/estimation_impl.hpp"
#include "estimator/solve/periodic/continuation.hpp"
#include "estimator/solve/periodic/floquet.hpp"
#include "estimator/solve/periodic/multi_period.hpp"

namespace shaker::estimator {
namespace {

constexpr double kClearlyBetter = 0.5;  // misfit ratio below which the other branch wins
constexpr int kEquationSteps = 12;

// The largest Floquet multiplier where it is surely above 1; otherwise 0. A solution that is clearly
// stable is not followed closely: kinks take many steps. The multiplier of two that nearly coincide
// may be off by the root of the matrix' error.
double unstable_multiplier(const PeriodicSystem& solution, const std::vector<double>& theta) {
  for (const double tolerance : {1e-3, 1e-6}) {
    const auto stability = floquet(solution, theta, tolerance);
    if (!stability || stability->largest() + std::sqrt(stability->error) < 1.0) return 0.0;
    if (tolerance == 1e-6 && stability->largest() - stability->error > 1.0)
      return stability->largest();
  }
  return 0.0;
}

}  // namespace

// Gauss-Newton on the residuals of the equations along the measured motion. Returns false if the
// motion is not known (several coordinates) or inadmissible for the model.
bool Estimator::Impl::start_from_equations() {
  const std::size_t q = data.free.size();
  if (data.model.coordinates() != 1) return false;
  for (std::size_t r = 0; r < solutions.systems.size(); ++r) {
    if (!data.start_from_data(r, solutions.systems[r])) return false;
  }
  for (int step = 0; step < kEquationSteps; ++step) {
    std::fill(equations.gram.begin(), equations.gram.end(), 0.0);
    std::fill(equations.gradient.begin(), equations.gradient.end(), 0.0);
    for (PeriodicSystem& system : solutions.systems) {
      if (!system.linearise(fit.theta)) return false;
      for (int i = 0; i < system.points(); ++i) {
        for (std::size_t k = 0; k < q; ++k) {
          const double slope = system.g_theta(i, 0, data.free[k]);
          equations.gradient[k] -= slope * system.g(i, 0);
          for (std::size_t l = 0; l <= k; ++l)
            equations.gram[k * q + l] += slope * system.g_theta(i, 0, data.free[l]);
        }
      }
    }
    if (!equations.step(fit.theta, 1e-9)) return false;
    search.move_theta();
    if (equations.relative_step(fit.theta) < 1e-6) break;
  }
  return true;
}

// Fits once more from the data and keeps the better of the two fits.
void Estimator::Impl::refit_on_data_branch(const std::vector<double>& start) {
  const bool had = fit.status != FitStatus::no_solution;
  const double before = had ? data.worst_misfit(solutions.systems) : 1e300;
  const double enough = fit.status == FitStatus::converged ? kClearlyBetter : 1.0;
  const Fit first = fit;
  std::vector<std::vector<double>> states;
  for (const PeriodicSystem& system : solutions.systems)
    states.emplace_back(system.state().begin(), system.state().end());
  fit.theta = start;
  if (start_from_equations()) {
    const std::vector<double> from_equations = fit.theta;
    fit.trouble.clear();
    fit.iterates.clear();
    fit.status = FitStatus::not_converged;
    fit.nested = !lifted.run(false);
    if (fit.nested) {
      fit.theta = from_equations;
      nested.run(from_equations, false, true);
    }
    if (fit.status == FitStatus::converged &&
        data.worst_misfit(solutions.systems) < enough * before)
      return;
  }
  fit = first;
  for (std::size_t r = 0; r < solutions.systems.size(); ++r)
    std::copy(states[r].begin(), states[r].end(), solutions.systems[r].state().begin());
  if (!had) return;
  for (PeriodicSystem& system : solutions.systems)
    system.solve(fit.theta);
  search.accumulate();
}

std::vector<std::string> Estimator::Impl::branch_warnings() {
  std::vector<std::string> warnings;
  if (fit.status != FitStatus::converged) return warnings;  // nothing is claimed then
  for (std::size_t r = 0; r < data.runs.size(); ++r) {
    const RunState& run = data.runs[r];
    const std::string where = fmt::format("run {} ({:g} Hz)", r + 1, run.data.frequency_hz);
    // A system that was solved in a batch has its state from there, but no linearisation.
    if (!solutions.packs.empty() && !solutions.systems[r].linearise(fit.theta)) continue;
    const double multiplier = unstable_multiplier(solutions.systems[r], fit.theta);
    if (multiplier > 1.0)
      warnings.push_back(fmt::format(
          "{}: the fitted periodic solution is unstable (a Floquet multiplier of {:.3g}), so the "
          "rig cannot have been on it; start from other parameters, or check the model",
          where, multiplier));
    if (data.lost_subharmonic(r, solutions.systems[r]))
      warnings.push_back(fmt::format(
          "{}: the data repeat after {} periods of the excitation, the fitted solution after one; "
          "start from other parameters",
          where, run.data.periods));
    const double here = data.misfit(r, solutions.systems[r]);
    if (!(here > kFarFromData)) continue;
    PeriodicSystem other(data.runs[r].data.model_or(data.model), solutions.systems[r].options());
    other.set_excitation_points(solutions.systems[r].frequency(),
                                solutions.systems[r].excitation());
    if (data.start_from_data(r, other) && other.solve(fit.theta).status == SolveStatus::converged &&
        data.misfit(r, other) < kClearlyBetter * here)
      warnings.push_back(fmt::format(
          "{}: the fit stands on another branch of periodic solutions than the data: with these "
          "parameters a second solution is {:.2g} times nearer to them; start from other "
          "parameters",
          where, here / data.misfit(r, other)));
  }
  return warnings;
}

}  // namespace shaker::estimator
