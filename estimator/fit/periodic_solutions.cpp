#include "estimator/fit/internal/periodic_solutions.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/solve/periodic/continuation.hpp"
#include "estimator/solve/periodic/multi_period.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kFewestCoarse = 24;
constexpr int kFewestWithMemory = 64;
// A step of one batch costs as much as the steps of this many single systems.
constexpr std::size_t kSingleStepsPerBatch = 3;
constexpr double kNoSolutionMisfit = 1e300;  // misfit if there is no solution

// Steps of the coarse grid between two data: one, but an internal state of first order, which may
// change fast, needs more points than a motion. They divide those of the fine grid.
int coarse_steps(const Model& model, const RunState& run) {
  bool fast = false;
  for (int c = 0; c < model.coordinates(); ++c)
    fast = fast || model.order(c) == 1;
  if (!fast) return 1;
  const int count = static_cast<int>(run.data.displacement.size());
  for (int steps = 1; steps < run.every; ++steps) {
    if (run.every % steps == 0 && count * steps >= kFewestWithMemory * run.data.periods)
      return steps;
  }
  return 1;
}

// Goes back to `share` of the way from `before` to `values`.
void shorten_to(double share, const double* before, double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    values[i] = before[i] + share * (values[i] - before[i]);
}

std::size_t state_size(const PeriodicLanes& lanes) {
  return static_cast<std::size_t>(lanes.points()) * kLanes;
}

// Whether the runs have a coarse grid: that of the data's own points.
bool has_coarse_grid(const FitData& data) {
  return data.options.method == Method::lifted && data.options.grid.scheme != Scheme::fourier &&
         data.model.instruments().empty() &&
         std::all_of(data.runs.begin(), data.runs.end(), [](const RunState& run) {
           return run.every >= 2 && run.data.sample_weight.empty() &&
                  run.data.displacement.size() >=
                      kFewestCoarse * static_cast<std::size_t>(run.data.periods);
         });
}

void put_excitation(const RunData& run, int harmonics, PeriodicSystem& system) {
  if (!run.excitation.empty())
    system.set_excitation(run.frequency_hz / run.periods, run.excitation, harmonics * run.periods);
  else if (run.periods > 1)
    set_excitation_over(system, run.periods, run.frequency_hz, run.amplitude);
  else
    system.set_excitation(run.frequency_hz, run.amplitude);
}

}  // namespace

PeriodicSolutions::PeriodicSolutions(FitData& the_data) : data(the_data) {
  systems.reserve(data.runs.size());
  for (const RunState& run : data.runs) {
    systems.emplace_back(run.data.model_or(data.model), run.grid);
    saved_.emplace_back(systems.back().state().size());
  }
  const bool with_coarse = has_coarse_grid(data);
  coarse.reserve(with_coarse ? data.runs.size() : 0);
  for (RunState& run : data.runs) {
    if (!with_coarse) break;
    GridOptions grid = data.options.grid;
    const auto count = static_cast<int>(run.data.displacement.size());
    run.coarse_every = coarse_steps(run.data.model_or(data.model), run);
    grid.points = count * run.coarse_every;
    coarse.emplace_back(run.data.model_or(data.model), grid);
  }
  for (std::size_t r = 0; r < data.runs.size(); ++r)
    load(r);
  make_packs();
  for (RunPack& pack : packs)
    pack.load(data, systems, coarse);
}

void PeriodicSolutions::make_packs() {
  const bool possible = data.options.method == Method::lifted &&
                        PeriodicLanes::possible(data.model, data.options.grid) &&
                        std::all_of(data.runs.begin(), data.runs.end(), [](const RunState& run) {
                          return run.every > 0 && !run.harmonic() && !run.data.model &&
                                 run.data.sample_weight.empty();
                        });
  if (!possible || data.runs.size() < kSingleStepsPerBatch) return;
  const auto points = [&](std::size_t r) { return systems[r].points(); };
  const auto count = [&](std::size_t r) { return data.runs[r].data.displacement.size(); };
  for (std::size_t r = 0; r < data.runs.size(); ++r) {
    auto pack = std::find_if(packs.begin(), packs.end(), [&](const RunPack& other) {
      return other.runs.size() < kLanes && points(other.runs[0]) == points(r) &&
             count(other.runs[0]) == count(r);
    });
    if (pack == packs.end()) {
      packs.emplace_back(data.model, systems[r].options(), static_cast<int>(count(r)),
                         !coarse.empty());
      pack = packs.end() - 1;
    }
    pack->runs.push_back(r);
  }
  if (packs.size() * kSingleStepsPerBatch > data.runs.size()) packs.clear();
}

void PeriodicSolutions::load(std::size_t r) {
  const int harmonics = data.options.excitation_harmonics;
  put_excitation(data.runs[r].data, harmonics, systems[r]);
  if (!coarse.empty()) put_excitation(data.runs[r].data, harmonics, coarse[r]);
  for (RunPack& pack : packs) {
    if (std::find(pack.runs.begin(), pack.runs.end(), r) != pack.runs.end())
      pack.load(data, systems, coarse);
  }
}

void PeriodicSolutions::states_to_packs(bool approach) {
  for (RunPack& pack : packs)
    pack.take_states(approach, level(approach));
}

void PeriodicSolutions::packs_to_systems() {
  for (const RunPack& pack : packs)
    pack.give_states(systems);
}

void PeriodicSolutions::coarse_to_fine() {
  for (RunPack& pack : packs) {
    pack.coarse->learn_jumps(kAllLanes);
    pack.fine.interpolate_from(*pack.coarse);
  }
  for (std::size_t r = 0; packs.empty() && r < systems.size(); ++r)
    systems[r].interpolate_from(coarse[r]);
}

bool PeriodicSolutions::linearise(bool approach, const std::vector<double>& theta,
                                  std::vector<double>& products) {
  if (!packs.empty()) {
    std::fill(products.begin(), products.end(), 0.0);
    for (RunPack& pack : packs) {
      if (!pack.add_products(approach, theta, products)) return false;
    }
    return true;
  }
  for (PeriodicSystem& system : level(approach)) {
    if (!system.linearise(theta) || !system.solve_step()) return false;
  }
  sum_products(approach, true, products);
  return true;
}

void PeriodicSolutions::sum_products(bool approach, bool with_newton,
                                     std::vector<double>& products) {
  const std::size_t size = 1 + static_cast<std::size_t>(data.model.parameter_count());
  std::fill(products.begin(), products.end(), 0.0);
  for (std::size_t r = 0; r < data.runs.size(); ++r) {
    const RunState& run = data.runs[r];
    PeriodicSystem& system = level(approach)[r];
    const int every = approach ? run.coarse_every : run.every;
    const bool plain = every > 0 && !run.harmonic() && run.data.sample_weight.empty();
    if (plain && system.add_products(run.data.displacement, every, with_newton,
                                     run.inverse_variance, products.data()))
      continue;
    data.for_each_datum(r, systems[r], with_newton,
                        [&](const double* row, double residual, double weight) {
                          products[0] += weight * residual * residual;
                          for (std::size_t k = 1; k < size; ++k) {
                            products[k * size] += weight * row[k] * residual;
                            for (std::size_t l = 1; l <= k; ++l)
                              products[k * size + l] += weight * row[k] * row[l];
                          }
                        });
  }
}

double PeriodicSolutions::advance(bool approach, const std::vector<double>& change) {
  double step = 0.0;
  for (RunPack& pack : packs)
    step = std::max(step, pack.advance(approach, change));
  if (!packs.empty()) return step;
  for (PeriodicSystem& system : level(approach))
    step = std::max(step, system.advance(1.0, change));
  return step;
}

void PeriodicSolutions::save(bool approach) {
  for (RunPack& pack : packs)
    std::copy_n(pack.level(approach).state(), state_size(pack.level(approach)), pack.saved.begin());
  for (std::size_t r = 0; packs.empty() && r < systems.size(); ++r) {
    const auto state = level(approach)[r].state();
    std::copy(state.begin(), state.end(), saved_[r].begin());
  }
}

void PeriodicSolutions::shorten(bool approach, double share) {
  for (RunPack& pack : packs)
    shorten_to(share, pack.saved.data(), pack.level(approach).state(),
               state_size(pack.level(approach)));
  for (std::size_t r = 0; packs.empty() && r < systems.size(); ++r) {
    const auto state = level(approach)[r].state();
    shorten_to(share, saved_[r].data(), state.data(), state.size());
  }
}

// Starts at the solution computed from rest, whose misfit is `from_rest` (kNoSolutionMisfit: no
// solution), and looks for one nearer to the data. Returns false and restores the state if there is
// none. With wrong parameters the measured motion may be inadmissible for the model, for example an
// oleo shorter than its stroke. The start then goes only part of the way from rest to the data.
bool PeriodicSolutions::solve_near_data(std::size_t r, const std::vector<double>& theta,
                                        double from_rest) {
  PeriodicSystem& system = systems[r];
  const std::vector<double> rest(system.state().begin(), system.state().end());
  for (const double share : {1.0, 0.85, 0.7, 0.5}) {
    if (!data.start_from_data(r, system, share)) return false;
    const bool converged = system.solve(theta).status == SolveStatus::converged;
    if (converged && data.misfit(r, system) < from_rest) return true;
    std::copy(rest.begin(), rest.end(), system.state().begin());
    if (converged || from_rest == kNoSolutionMisfit) return false;
  }
  return false;
}

SolveReport PeriodicSolutions::solve_run(std::size_t r, const std::vector<double>& theta,
                                         bool warm) {
  PeriodicSystem& system = systems[r];
  if (warm) {
    const SolveReport report = system.solve(theta);
    if (report.status == SolveStatus::converged) return report;
  }
  SolveReport report = system.solve_from_rest(theta);
  const bool converged = report.status == SolveStatus::converged;
  const double from_rest = converged ? data.misfit(r, system) : kNoSolutionMisfit;
  if (from_rest <= kFarFromData && !data.lost_subharmonic(r, system)) return report;
  if (solve_near_data(r, theta, from_rest)) return {};
  if (converged) return system.solve(theta);
  if (report.status == SolveStatus::no_convergence) report = solve_through_folds(system, theta);
  return report;
}

std::string PeriodicSolutions::solve_all(const std::vector<double>& theta, bool warm) {
  for (std::size_t r = 0; r < systems.size(); ++r) {
    const SolveReport report = solve_run(r, theta, warm);
    if (report.status == SolveStatus::converged) continue;
    const bool at_rest = report.status == SolveStatus::no_equilibrium;
    return fmt::format("run {} ({:g} Hz): {}; give starting values nearer to the damper's{}", r + 1,
                       data.runs[r].data.frequency_hz, report.sentence(),
                       at_rest ? "" : ", or check the excitation's size and unit");
  }
  return {};
}

}  // namespace shaker::estimator
