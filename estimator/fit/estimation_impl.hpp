// The workspace behind Estimator. Private to the sources of the estimator.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/math/grid_reading.hpp"
#include "estimator/periodic/newton_rate.hpp"
#include "estimator/periodic/periodic_lanes.hpp"

namespace shaker::estimator {

// Throws std::invalid_argument for data that cannot be used; the message counts runs from 1.
void check_run(const RunData& run, std::size_t index);

// The lifted method leaves the coarse grid (the data's own points) at this relative step.
inline constexpr double kCloseEnough = 1e-2;

struct RunState {
  RunData data;
  double inverse_variance = 1.0;  // relative: cycles * weight
  int every = 0;                  // data on every so many-th grid point; 0: between grid points
  int coarse_every = 1;           // the same on the coarse grid
  std::vector<GridReading> readings;
  // Tables for a start from the data: samples -> first harmonics -> state on the grid.
  std::vector<double> analysis;
  std::vector<double> synthesis;
  std::vector<double> coefficients;
  std::vector<double> saved;  // state before a trial step
  // For Fourier coefficients c with covariance S = L L^T: the whitened data L^-1 c (m values), and
  // the operator from a state on the grid to its whitened coefficients (points x m).
  std::vector<double> whitened, projector;
  bool harmonic() const { return !data.harmonics.empty(); }
  std::size_t count() const { return harmonic() ? whitened.size() : readings.size(); }
};

// A batch of up to eight runs with equal numbers of points, one a lane. Lanes without a run repeat
// the last run with weight zero.
struct RunPack {
  RunPack(const Model& model, const GridOptions& grid, int data_points, bool with_coarse);
  PeriodicLanes fine;
  std::unique_ptr<PeriodicLanes> coarse;
  std::vector<std::size_t> runs;
  int every = 1;
  AlignedVector data, weight, products, delta, newton_step, saved;
};

struct Estimator::Impl {
  Impl(const Model& model, std::vector<RunData> runs, EstimationOptions options);

  const Model& model;
  EstimationOptions options;
  std::vector<RunState> runs;
  std::vector<PeriodicSystem> systems;
  std::vector<PeriodicSystem> coarse;  // on few points, for the first steps; or empty
  std::vector<RunPack> packs;          // all runs in batches; empty: one system after another
  std::vector<int> free;               // indices of the free parameters
  Fit fit;

  // Normal equations at the last linearisation: gram * delta = gradient over the free parameters.
  std::vector<double> gram, gradient, scratch_matrix, scratch_vector, delta, delta_full, factors;
  std::vector<double> theta_saved, lifted_start, products;
  std::vector<char> held;            // free parameters at a bound that the gradient pushes outwards
  std::vector<char> pinned;          // free parameters that a profile fit holds
  std::vector<double> inverse_gram;  // of the last fit, free x free
  Fit kept;
  double sum_of_squares = 0.0;
  double total_scatter = 0.0;  // weighted, of the single cycles about their means
  long observations = 0;
  bool priors = false;       // at least one free parameter has a prior
  bool covariances = false;  // the data are Fourier coefficients
  double last_step = 0.0;    // relative, of the lifted method

  void make_coarse_level();
  void make_packs();
  void load(std::size_t run);
  void load_pack(RunPack& pack);
  void prepare_readings(RunState& run, int points);
  void prepare_harmonics(RunState& run, int points);
  void prepare_projector(RunState& run, int points);
  // Moves the observed coordinate by `share` of the way from its present state to the data's first
  // harmonics. The other coordinates stay. Returns false if the data give no such start.
  bool start_from_data(std::size_t run, PeriodicSystem& system, double share = 1.0);

  // Sums gram, gradient and sum of squares over all runs. `with_newton` (the lifted method): the
  // residuals include the Newton step of the periodic solution.
  void accumulate(std::vector<PeriodicSystem>& level, bool with_newton);
  void normal_equations();  // from `products`
  // Solves (gram + lambda diag) delta = gradient inside the bounds. Returns false if the matrix is
  // not positive definite.
  bool box_step(double lambda);
  bool solve_free(double lambda);
  bool stays_inside(double lambda) const;
  template <int Most>
  bool box_minimum_step(double lambda);
  double relative_step() const;

  bool fit_lifted(bool warm);
  // The steps on one level. `first`: the start may be far, see estimation_lifted.cpp.
  bool lifted_steps(bool approach, bool first);
  bool start_along_data(double share);
  void save_before_step(bool approach);
  void shorten_last_step(bool approach, double share);
  // linearise_all linearises all solutions and sums the normal equations. advance_all moves the
  // solutions along `delta_full` and returns the largest relative Newton step. Both work on the
  // batches if there are any, otherwise on one system after another.
  bool linearise_all(bool approach);
  double advance_all(bool approach);
  bool linearise_packs(bool approach);
  double advance_packs(bool approach);
  void states_to_packs(bool approach);
  void packs_to_systems();
  void fit_nested(const std::vector<double>& start, bool warm, bool damped);
  bool solve_after_step(bool damped, SolveReport& last, std::size_t& last_run);
  void step_back();
  std::string why_not_converged(const SolveReport& last, std::size_t run) const;
  bool cap_step(const std::vector<double>& start);
  double share_within(const std::vector<double>& start, double most) const;
  bool nothing_to_gain();
  double squares_of_data() const;
  bool solve_all(bool warm);
  // --- selection of the branch of solutions: estimation_branch.cpp
  SolveReport solve_run(std::size_t run, bool warm);
  bool solve_near_data(std::size_t run, double from_rest);
  // True if the data repeat only after all their periods but the solution repeats sooner.
  bool lost_subharmonic(std::size_t run, const PeriodicSystem& system) const;
  double motion_of_data(std::size_t run) const;  // root mean square about the mean; 0: no motion
  // Root mean square of data less solution, divided by motion_of_data; 0 for Fourier coefficients.
  double misfit(std::size_t run, const PeriodicSystem& system) const;
  bool fits_badly() const;
  bool start_from_equations();
  void refit_on_data_branch(const std::vector<double>& start);
  std::vector<std::string> branch_warnings();
  // --- gap between model and mean cycles: estimation_gap.cpp
  double mean_cycle_variance(std::size_t run) const;
  ModelGap model_gap() const;
  std::vector<std::string> gap_warnings(const ModelGap& gap) const;
  // Adds the normal priors (3.8) to the normal equations, with the present noise_variance().
  void add_priors();
  double prior_sum() const { return prior_sum_at(fit.theta); }
  // Sum of squares of (theta - mean) / standard deviation.
  double prior_sum_at(const std::vector<double>& theta) const;
  // The function that a successful step decreases.
  double objective() const;
  // Variance of an observation of weight 1: known, or from the last linearisation's sum of squares.
  double noise_variance() const;

  void finish();
  // Computes sensitivities and normal equations at theta anew. False if a solution is lost.
  bool look_anew();
  // Completes `fit` from the sum of squared residuals and `gram`. Returns false if gram is too
  // large or too badly conditioned, so that finish_by_svd must read the Jacobian.
  bool finish_from(double residual_sum);
  void finish_errors();
  void forget_undetermined();
  double residual_sum() const;
  void finish_noise();
  void adjust_for_estimated_covariance();
  bool finish_definite(const std::vector<double>& scale, std::size_t count);
  void add_excitation_error(const std::vector<double>& inverse);
  void finish_by_svd(const std::vector<double>& scale, std::size_t count);

  // Calls visit(row, residual, inverse variance) for every datum of a run. row[0] is the Newton
  // step of the datum, row[1 + k] its derivative with respect to theta_k.
  template <class Visit>
  void for_each_datum(std::size_t run, bool with_newton, Visit visit) const;

 private:
  template <class Visit>
  void for_each_coefficient(std::size_t run, bool with_newton, Visit visit) const;
  mutable std::vector<double> mixed_;      // a row interpolated between grid points, 1 + p
  mutable std::vector<double> projected_;  // rows of all coefficients, (2 + p) x m
};

template <class Visit>
void Estimator::Impl::for_each_coefficient(std::size_t r, bool with_newton, Visit visit) const {
  const RunState& run = runs[r];
  const PeriodicSystem& system = systems[r];
  const std::size_t m = run.whitened.size();
  const std::size_t width = mixed_.size();  // 1 + parameters
  projected_.assign((1 + width) * m, 0.0);
  for (int i = 0; i < system.points(); ++i) {
    const double* operation = &run.projector[static_cast<std::size_t>(i) * m];
    const auto row = system.observed_row(i);
    const double value = system.observed(i) + (with_newton ? row[0] : 0.0);
    for (std::size_t k = 0; k <= width; ++k) {
      const double factor = k < width ? row[k] : value;
      double* out = &projected_[k * m];
      for (std::size_t j = 0; j < m; ++j)
        out[j] += factor * operation[j];
    }
  }
  for (std::size_t j = 0; j < m; ++j) {
    for (std::size_t k = 0; k < width; ++k)
      mixed_[k] = projected_[k * m + j];
    visit(mixed_.data(), run.whitened[j] - projected_[width * m + j], 1.0);
  }
}

template <class Visit>
void Estimator::Impl::for_each_datum(std::size_t r, bool with_newton, Visit visit) const {
  const RunState& run = runs[r];
  if (run.harmonic()) return for_each_coefficient(r, with_newton, visit);
  const PeriodicSystem& system = systems[r];
  const double* sample = run.data.sample_weight.empty() ? nullptr : run.data.sample_weight.data();
  const int n = system.points();
  for (std::size_t j = 0; j < run.readings.size(); ++j) {
    const GridReading& reading = run.readings[j];
    const double weight = run.inverse_variance * (sample != nullptr ? sample[j] : 1.0);
    if (reading.count == 1) {
      const double* row = system.observed_row(reading.base).data();
      const double predicted = system.observed(reading.base) + (with_newton ? row[0] : 0.0);
      visit(row, run.data.displacement[j] - predicted, weight);
      continue;
    }
    double predicted = 0.0;
    std::fill(mixed_.begin(), mixed_.end(), 0.0);
    for (int k = 0; k < reading.count; ++k) {
      int point = reading.base + k;
      if (point >= n) point -= n;
      const auto row = system.observed_row(point);
      const double w = reading.weight[k];
      predicted += w * (system.observed(point) + (with_newton ? row[0] : 0.0));
      for (std::size_t m = 0; m < row.size(); ++m)
        mixed_[m] += w * row[m];
    }
    visit(mixed_.data(), run.data.displacement[j] - predicted, weight);
  }
}

}  // namespace shaker::estimator
