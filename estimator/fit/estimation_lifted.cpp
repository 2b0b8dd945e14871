// Lifted Gauss-Newton: one iteration moves theta and the periodic solutions together.
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fit/estimation_impl.hpp"

namespace shaker::estimator {
namespace {

// Shares of the way from rest to the data at which a start is tried: with wrong parameters the
// measured motion may be inadmissible for the model, for example an oleo shorter than its stroke.
constexpr double kShares[] = {1.0, 0.7, 0.5, 0.3};
constexpr double kMostMove = 0.5;  // of a parameter in a step on the first level
constexpr int kMostHalvings = 8;

}  // namespace

// The iteration is trusted only while it contracts. A singular matrix or steps that do not shrink
// end it with false, and the caller starts the nested method from the given parameters. The first
// steps, which need little accuracy, use a coarse grid. There the start may be far: a step that
// leads to an inadmissible point is halved. The data show one coordinate only; the others start
// from their own equations along it.
bool Estimator::Impl::fit_lifted(bool warm) {
  last_step = std::numeric_limits<double>::infinity();
  if (warm) {
    states_to_packs(false);
  } else {
    const bool approach = !coarse.empty();
    const int before = fit.iterations;
    lifted_start = fit.theta;
    bool arrived = false;
    for (const double share : kShares) {
      if (arrived || fit.iterations > before) break;  // or the steps had begun, and failed later
      arrived = start_along_data(share) && lifted_steps(approach, true);
    }
    if (!arrived) return false;
    if (!approach) {
      packs_to_systems();
      return true;
    }
    for (RunPack& pack : packs) {
      pack.coarse->learn_jumps(kAllLanes);
      pack.fine.interpolate_from(*pack.coarse);
    }
    for (std::size_t r = 0; packs.empty() && r < runs.size(); ++r)
      systems[r].interpolate_from(coarse[r]);
  }
  if (!lifted_steps(false, false)) return false;
  packs_to_systems();
  return true;
}

// The start on the first level. Without the way from rest (share 1) nothing is computed for a model
// of one coordinate.
bool Estimator::Impl::start_along_data(double share) {
  const bool approach = !coarse.empty();
  auto& first = approach ? coarse : systems;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (share < 1.0 && first[r].solve_from_rest(fit.theta, PeriodicSystem::kTolerance, 0).status ==
                           SolveStatus::no_equilibrium)
      return false;
    if (!start_from_data(r, first[r], share) || !first[r].follow_observed(fit.theta)) return false;
  }
  states_to_packs(approach);
  return true;
}

void Estimator::Impl::save_before_step(bool approach) {
  theta_saved = fit.theta;
  for (RunPack& pack : packs) {
    PeriodicLanes& lanes = approach ? *pack.coarse : pack.fine;
    std::copy_n(lanes.state(), static_cast<std::size_t>(lanes.points()) * kLanes,
                pack.saved.begin());
  }
  for (std::size_t r = 0; packs.empty() && r < runs.size(); ++r) {
    const auto state = (approach ? coarse : systems)[r].state();
    std::copy(state.begin(), state.end(), runs[r].saved.begin());
  }
}

// Goes back to `share` of the last step.
void Estimator::Impl::shorten_last_step(bool approach, double share) {
  const auto shorten = [&](double* values, std::size_t count, const double* before) {
    for (std::size_t i = 0; i < count; ++i)
      values[i] = before[i] + share * (values[i] - before[i]);
  };
  shorten(fit.theta.data(), fit.theta.size(), theta_saved.data());
  for (RunPack& pack : packs) {
    PeriodicLanes& lanes = approach ? *pack.coarse : pack.fine;
    shorten(lanes.state(), static_cast<std::size_t>(lanes.points()) * kLanes, pack.saved.data());
  }
  for (std::size_t r = 0; packs.empty() && r < runs.size(); ++r) {
    const auto state = (approach ? coarse : systems)[r].state();
    shorten(state.data(), state.size(), runs[r].saved.data());
  }
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

bool Estimator::Impl::lifted_steps(bool approach, bool first) {
  int without_progress = 0, halvings = 0;
  for (int iteration = 1; iteration <= options.max_iterations; ++iteration) {
    if (!linearise_all(approach)) {
      if (!first || iteration == 1 || ++halvings > kMostHalvings) return false;
      shorten_last_step(approach, 0.5);
      continue;
    }
    halvings = 0;
    if (!box_step(0.0)) return false;
    if (first) save_before_step(approach);
    const double state_step = advance_all(approach);
    const double step = std::max(relative_step(), state_step);
    const double share = first ? share_within(lifted_start, kMostMove) : 1.0;
    for (std::size_t k = 0; k < fit.theta.size(); ++k)
      fit.theta[k] += delta_full[k];
    if (share < 1.0) shorten_last_step(approach, share);
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
    if (share == 1.0 && step > 0.9 * last_step && iteration > 2 && ++without_progress > 3)
      return false;
    last_step = step;
  }
  return false;
}

}  // namespace shaker::estimator
