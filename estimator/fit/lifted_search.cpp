#include <algorithm>
#include <cmath>

#include "estimator/fit/internal/searches.hpp"
#include "estimator/math/damped_minimum.hpp"
#include "estimator/solve/periodic/newton_rate.hpp"

namespace shaker::estimator {
namespace {

// Shares of the way from rest to the data at which a start is tried: with wrong parameters the
// measured motion may be inadmissible for the model, for example an oleo shorter than its stroke.
constexpr double kShares[] = {1.0, 0.7, 0.5, 0.3};
constexpr double kMostMove = 0.5;  // of a parameter in a step on the first level
constexpr int kMostHalvings = 8;
constexpr double kMaxRelativeStep = 1e3;   // beyond it the iteration has diverged
constexpr double kEndOfCoarseGrid = 1e-2;  // relative step at which the coarse grid is left
constexpr double kMaxStateStep = 1e-6;     // relative, of a step that converged
constexpr double kMinShrinking = 0.9;      // a step that is longer, relative to the one before
constexpr int kMaxWithoutProgress = 3;

}  // namespace

void Search::accumulate() const {
  solutions.sum_products(false, false, equations.products);
  equations.form(fit.theta);
}

void Search::move_theta() const {
  for (std::size_t k = 0; k < fit.theta.size(); ++k)
    fit.theta[k] += equations.delta_full[k];
}

LiftedProgress::Next LiftedProgress::after_step(double step, double state_step, int iteration,
                                                bool approach, bool whole, double tolerance) {
  if (!std::isfinite(step) || step > kMaxRelativeStep) return Next::failed;
  const double before = last_step_;
  last_step_ = step;
  if (approach && step <= kEndOfCoarseGrid) return Next::finer_grid;
  if (left_after(step, before) <= tolerance && state_step < kMaxStateStep) return Next::done;
  const bool progress = !whole || iteration <= 2 || step <= kMinShrinking * before;
  if (!progress && ++without_progress_ > kMaxWithoutProgress) return Next::failed;
  return Next::another_step;
}

// A step that led to an inadmissible point is halved, where the start may be far.
struct LiftedSearch::Halving : NoDamping {
  LiftedSearch& search;
  int halvings = 0;

  explicit Halving(LiftedSearch& of) : search(of) {}
  bool raise_after_invalid_step() {
    const Steps& now = search.now_;
    if (now.admissible || !now.first || now.iteration == 1 || ++halvings > kMostHalvings)
      return false;
    search.shorten_last_step(now.approach, 0.5);
    return true;
  }
  void lower_after_success() { halvings = 0; }
};

LiftedSearch::LiftedSearch(const Search& search) : Search(search) {}

// The iteration is trusted only while it contracts. A singular matrix or steps that do not shrink
// end it with false, and the caller starts the nested method from the given parameters. The first
// steps, which need little accuracy, use a coarse grid. There the start may be far: a step that
// leads to an inadmissible point is halved. The data show one coordinate only; the others start
// from their own equations along it.
bool LiftedSearch::run(bool warm) {
  progress_ = {};
  if (warm) {
    solutions.states_to_packs(false);
  } else {
    const bool approach = !solutions.coarse.empty();
    if (!approach_from_data()) return false;
    if (!approach) {
      solutions.packs_to_systems();
      return true;
    }
    solutions.coarse_to_fine();
  }
  if (!steps(false, false)) return false;
  solutions.packs_to_systems();
  return true;
}

// The steps on the first level, from the first start from which they begin.
bool LiftedSearch::approach_from_data() {
  const bool approach = !solutions.coarse.empty();
  const int before = fit.iterations;
  start_ = fit.theta;
  bool arrived = false;
  for (const double share : kShares) {
    if (arrived || fit.iterations > before) break;  // or the steps had begun, and failed later
    arrived = start_along_data(share) && steps(approach, true);
  }
  return arrived;
}

// The start on the first level. Without the way from rest (share 1) nothing is computed for a model
// of one coordinate.
bool LiftedSearch::start_along_data(double share) {
  const bool approach = !solutions.coarse.empty();
  std::vector<PeriodicSystem>& first = solutions.level(approach);
  for (std::size_t r = 0; r < first.size(); ++r) {
    if (share < 1.0 && first[r].solve_from_rest(fit.theta, PeriodicSystem::kTolerance, 0).status ==
                           SolveStatus::no_equilibrium)
      return false;
    if (!data.start_from_data(r, first[r], share) || !first[r].follow_observed(fit.theta))
      return false;
  }
  solutions.states_to_packs(approach);
  return true;
}

// Goes back to `share` of the last step.
void LiftedSearch::shorten_last_step(bool approach, double share) {
  for (std::size_t k = 0; k < fit.theta.size(); ++k)
    fit.theta[k] = theta_before_[k] + share * (fit.theta[k] - theta_before_[k]);
  solutions.shorten(approach, share);
}

bool LiftedSearch::steps(bool approach, bool first) {
  now_ = {approach, first};
  progress_.begin_grid();
  Halving halving{*this};
  return minimise_damped(*this, halving, data.options.max_iterations) == LoopEnd::converged;
}

bool LiftedSearch::compute_step(double /*lambda*/) {
  ++now_.iteration;
  now_.admissible = solutions.linearise(now_.approach, fit.theta, equations.products);
  if (!now_.admissible) return false;
  equations.form(fit.theta);
  return equations.step(fit.theta, 0.0);
}

bool LiftedSearch::step_is_successful() {
  if (now_.first) {
    theta_before_ = fit.theta;
    solutions.save(now_.approach);
  }
  const double state_step = solutions.advance(now_.approach, equations.delta_full);
  const double step = std::max(equations.relative_step(fit.theta), state_step);
  const double share = now_.first ? equations.share_within(fit.theta, start_, kMostMove) : 1.0;
  move_theta();
  if (share < 1.0) shorten_last_step(now_.approach, share);
  if (data.options.keep_iterates) fit.iterates.push_back(fit.theta);
  ++fit.iterations;
  now_.next = progress_.after_step(step, state_step, now_.iteration, now_.approach, share == 1.0,
                                   data.options.tolerance);
  if (now_.next == LiftedProgress::Next::done) fit.status = FitStatus::converged;
  return now_.next != LiftedProgress::Next::failed;
}

}  // namespace shaker::estimator
