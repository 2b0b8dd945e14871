// Lifted Gauss-Newton: one iteration moves theta and the periodic solutions together.
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fit/estimation_impl.hpp"

namespace shaker::estimator {
// The iteration is trusted only while it contracts. An inadmissible point, a singular matrix or
// steps that do not shrink end it with false, and the caller starts the nested method from the
// given parameters. The first steps, which need little accuracy, use the coarse grid of the data's
// own points.
bool Estimator::Impl::fit_lifted(bool warm) {
  last_step = std::numeric_limits<double>::infinity();
  if (!warm) {
    if (model.coordinates() != 1) return false;  // the data do not show the other coordinates
    auto& first = coarse.empty() ? systems : coarse;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (!start_from_data(r, first[r])) return false;
    }
    if (!coarse.empty()) {
      states_to_packs(true);
      if (!lifted_steps(true)) return false;
      for (RunPack& pack : packs) {
        pack.coarse->learn_jumps(kAllLanes);
        pack.fine.interpolate_from(*pack.coarse);
      }
      for (std::size_t r = 0; packs.empty() && r < runs.size(); ++r)
        systems[r].interpolate_from(coarse[r]);
    }
  }
  if (warm || coarse.empty()) states_to_packs(false);
  if (!lifted_steps(false)) return false;
  packs_to_systems();
  return true;
}

bool Estimator::Impl::linearise_all(bool approach) {
  if (!packs.empty()) return linearise_packs(approach);
  auto& level = approach ? coarse : systems;
  for (PeriodicSystem& system : level) {
    if (!system.linearise(fit.theta) || !system.solve_step()) return false;
  }
  accumulate(level, true);
  return true;
}

double Estimator::Impl::advance_all(bool approach) {
  if (!packs.empty()) return advance_packs(approach);
  double step = 0.0;
  for (PeriodicSystem& system : approach ? coarse : systems)
    step = std::max(step, system.advance(1.0, delta_full));
  return step;
}

bool Estimator::Impl::lifted_steps(bool approach) {
  int without_progress = 0;
  for (int iteration = 1; iteration <= options.max_iterations; ++iteration) {
    if (!linearise_all(approach)) return false;
    if (!box_step(0.0)) return false;
    const double state_step = advance_all(approach);
    const double step = std::max(relative_step(), state_step);
    for (std::size_t k = 0; k < fit.theta.size(); ++k)
      fit.theta[k] += delta_full[k];
    if (options.keep_iterates) fit.iterates.push_back(fit.theta);
    ++fit.iterations;
    if (!std::isfinite(step) || step > 1e3) return false;
    if (approach && step <= kCloseEnough) {
      last_step = step;
      return true;
    }
    if (left_after(step, last_step) <= options.tolerance && state_step < 1e-6) {
      fit.status = FitStatus::converged;
      return true;
    }
    if (step > 0.9 * last_step && iteration > 2 && ++without_progress > 3) return false;
    last_step = step;
  }
  return false;
}

}  // namespace shaker::estimator
