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

#include "estimator/fit/estimation_impl.hpp"
#include "estimator/periodic/continuation.hpp"
#include "estimator/periodic/floquet.hpp"
#include "estimator/periodic/multi_period.hpp"

namespace shaker::estimator {
namespace {

constexpr double kFarFromData = 0.1;          // misfit above which another branch is considered
constexpr double kClearlyBetter = 0.5;        // misfit ratio below which the other branch wins
constexpr double kMinSubharmonicShare = 0.1;  // of the data's subharmonic share
constexpr double kMinRelativeVariance =
    1e-12;                                   // of the mean square; a smaller variance is rounding
constexpr double kNoSolutionMisfit = 1e300;  // misfit if there is no solution
constexpr int kEquationSteps = 12;

}  // namespace

double Estimator::Impl::motion_of_data(std::size_t r) const {
  const std::vector<double>& y = runs[r].data.displacement;
  double mean = 0.0, square = 0.0;
  for (const double value : y) {
    mean += value / static_cast<double>(y.size());
    square += value * value / static_cast<double>(y.size());
  }
  // A record without motion is on no branch.
  const double variance = square - mean * mean;
  return variance > kMinRelativeVariance * square ? std::sqrt(variance) : 0.0;
}

double Estimator::Impl::misfit(std::size_t r, const PeriodicSystem& system) const {
  const RunState& run = runs[r];
  const double motion = motion_of_data(r);
  if (run.harmonic() || !(motion > 0.0)) return 0.0;
  double sum = 0.0;
  for (std::size_t j = 0; j < run.readings.size(); ++j) {
    const GridReading& reading = run.readings[j];
    double left = run.data.displacement[j];
    for (int k = 0; k < reading.count; ++k)
      left -= reading.weight[k] * system.observed((reading.base + k) % system.points());
    sum += left * left;
  }
  return std::sqrt(sum / static_cast<double>(run.readings.size())) / motion;
}

bool Estimator::Impl::lost_subharmonic(std::size_t r, const PeriodicSystem& system) const {
  const RunState& run = runs[r];
  return run.data.periods > 1 && !run.harmonic() &&
         subharmonic_share(system, run.data.periods) <
             kMinSubharmonicShare * subharmonic_share(run.data.displacement, run.data.periods) &&
         subharmonic_stands_out(run.data.displacement, run.data.periods);
}

bool Estimator::Impl::fits_badly() const {
  if (fit.status == FitStatus::no_solution) return true;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (misfit(r, systems[r]) > kFarFromData || lost_subharmonic(r, systems[r])) return true;
  }
  return false;
}

// Starts at the solution computed from rest, whose misfit is `from_rest` (kNoSolutionMisfit: no
// solution), and looks for one nearer to the data. Returns false and restores the state if there is
// none. With wrong parameters the measured motion may be inadmissible for the model, for example an
// oleo shorter than its stroke. The start then goes only part of the way from rest to the data.
bool Estimator::Impl::solve_near_data(std::size_t r, double from_rest) {
  PeriodicSystem& system = systems[r];
  const std::vector<double> rest(system.state().begin(), system.state().end());
  for (const double share : {1.0, 0.85, 0.7, 0.5}) {
    if (!start_from_data(r, system, share)) return false;
    const bool converged = system.solve(fit.theta).status == SolveStatus::converged;
    if (converged && misfit(r, system) < from_rest) return true;
    std::copy(rest.begin(), rest.end(), system.state().begin());
    if (converged || from_rest == kNoSolutionMisfit) return false;
  }
  return false;
}

SolveReport Estimator::Impl::solve_run(std::size_t r, bool warm) {
  PeriodicSystem& system = systems[r];
  if (warm) {
    const SolveReport report = system.solve(fit.theta);
    if (report.status == SolveStatus::converged) return report;
  }
  SolveReport report = system.solve_from_rest(fit.theta);
  const bool converged = report.status == SolveStatus::converged;
  const double from_rest = converged ? misfit(r, system) : kNoSolutionMisfit;
  if (from_rest <= kFarFromData && !lost_subharmonic(r, system)) return report;
  if (solve_near_data(r, from_rest)) return {};
  if (converged) return system.solve(fit.theta);
  if (report.status == SolveStatus::no_convergence) report = solve_through_folds(system, fit.theta);
  return report;
}

bool Estimator::Impl::solve_all(bool warm) {
  for (std::size_t r = 0; r < systems.size(); ++r) {
    const SolveReport report = solve_run(r, warm);
    if (report.status == SolveStatus::converged) continue;
    const bool at_rest = report.status == SolveStatus::no_equilibrium;
    fit.trouble = fmt::format("run {} ({:g} Hz): {}; give starting values nearer to the damper's{}",
                              r + 1, runs[r].data.frequency_hz, report.sentence(),
                              at_rest ? "" : ", or check the excitation's size and unit");
    return false;
  }
  return true;
}

// Gauss-Newton on the residuals of the equations along the measured motion. Returns false if the
// motion is not known (several coordinates) or inadmissible for the model.
bool Estimator::Impl::start_from_equations() {
  const std::size_t q = free.size();
  if (model.coordinates() != 1) return false;
  for (std::size_t r = 0; r < systems.size(); ++r) {
    if (!start_from_data(r, systems[r])) return false;
  }
  for (int step = 0; step < kEquationSteps; ++step) {
    std::fill(gram.begin(), gram.end(), 0.0);
    std::fill(gradient.begin(), gradient.end(), 0.0);
    for (PeriodicSystem& system : systems) {
      if (!system.linearise(fit.theta)) return false;
      for (int i = 0; i < system.points(); ++i) {
        for (std::size_t k = 0; k < q; ++k) {
          const double slope = system.g_theta(i, 0, free[k]);
          gradient[k] -= slope * system.g(i, 0);
          for (std::size_t l = 0; l <= k; ++l)
            gram[k * q + l] += slope * system.g_theta(i, 0, free[l]);
        }
      }
    }
    if (!box_step(1e-9)) return false;
    for (std::size_t k = 0; k < fit.theta.size(); ++k)
      fit.theta[k] += delta_full[k];
    if (relative_step() < 1e-6) break;
  }
  return true;
}

// Fits once more from the data and keeps the better of the two fits.
void Estimator::Impl::refit_on_data_branch(const std::vector<double>& start) {
  const auto worst = [&] {
    double sum = 0.0;
    for (std::size_t r = 0; r < runs.size(); ++r)
      sum = std::max(sum, misfit(r, systems[r]));
    return sum;
  };
  const bool had = fit.status != FitStatus::no_solution;
  const double before = had ? worst() : 1e300;
  const double enough = fit.status == FitStatus::converged ? kClearlyBetter : 1.0;
  const Fit first = fit;
  std::vector<std::vector<double>> states;
  for (const PeriodicSystem& system : systems)
    states.emplace_back(system.state().begin(), system.state().end());
  fit.theta = start;
  if (start_from_equations()) {
    const std::vector<double> from_equations = fit.theta;
    fit.trouble.clear();
    fit.iterates.clear();
    fit.status = FitStatus::not_converged;
    fit.nested = !fit_lifted(false);
    if (fit.nested) {
      fit.theta = from_equations;
      fit_nested(from_equations, false, true);
    }
    if (fit.status == FitStatus::converged && worst() < enough * before) return;
  }
  fit = first;
  for (std::size_t r = 0; r < systems.size(); ++r)
    std::copy(states[r].begin(), states[r].end(), systems[r].state().begin());
  if (!had) return;
  for (PeriodicSystem& system : systems)
    system.solve(fit.theta);
  accumulate(systems, false);
}

std::vector<std::string> Estimator::Impl::branch_warnings() {
  std::vector<std::string> warnings;
  if (fit.status != FitStatus::converged) return warnings;  // nothing is claimed then
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunState& run = runs[r];
    const std::string where = fmt::format("run {} ({:g} Hz)", r + 1, run.data.frequency_hz);
    // A system that was solved in a batch has its state from there, but no linearisation.
    if (!packs.empty() && !systems[r].linearise(fit.theta)) continue;
    const auto stability = floquet(systems[r], fit.theta, 1e-6);
    if (stability && stability->largest() - stability->error > 1.0)
      warnings.push_back(fmt::format(
          "{}: the fitted periodic solution is unstable (a Floquet multiplier of {:.3g}), so the "
          "rig cannot have been on it; start from other parameters, or check the model",
          where, stability->largest()));
    if (lost_subharmonic(r, systems[r]))
      warnings.push_back(fmt::format(
          "{}: the data repeat after {} periods of the excitation, the fitted solution after one; "
          "start from other parameters",
          where, run.data.periods));
    const double here = misfit(r, systems[r]);
    if (!(here > kFarFromData)) continue;
    PeriodicSystem other(runs[r].data.model_or(model), systems[r].options());
    other.set_excitation_points(systems[r].frequency(), systems[r].excitation());
    if (start_from_data(r, other) && other.solve(fit.theta).status == SolveStatus::converged &&
        misfit(r, other) < kClearlyBetter * here)
      warnings.push_back(fmt::format(
          "{}: the fit stands on another branch of periodic solutions than the data: with these "
          "parameters a second solution is {:.2g} times nearer to them; start from other "
          "parameters",
          where, here / misfit(r, other)));
  }
  return warnings;
}

}  // namespace shaker::estimator
