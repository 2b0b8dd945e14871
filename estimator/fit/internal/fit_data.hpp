// The data of an estimation on their grids. Private to the sources of the estimator.
#pragma once

#include <algorithm>
#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/math/grid_reading.hpp"

namespace shaker::estimator {

inline constexpr double kFarFromData = 0.1;  // misfit above which another branch is considered

struct RunState {
  RunData data;
  GridOptions grid;
  double inverse_variance = 1.0;  // relative: cycles * weight
  int every = 0;                  // data on every so many-th grid point; 0: between grid points
  int coarse_every = 1;           // the same on the coarse grid
  std::vector<GridReading> readings;
  // Tables for a start from the data: samples -> first harmonics -> state on the grid.
  std::vector<double> analysis;
  std::vector<double> synthesis;
  std::vector<double> coefficients;
  // For Fourier coefficients c with covariance S = L L^T: the whitened data L^-1 c (m values), and
  // the operator from a state on the grid to its whitened coefficients (points x m).
  std::vector<double> whitened, projector;
  bool harmonic() const { return !data.harmonics.empty(); }
  std::size_t count() const { return harmonic() ? whitened.size() : readings.size(); }
};

// The runs, what is free in their model, and what single runs say of a solution.
struct FitData {
  FitData(const Model& model, std::vector<RunData> runs, EstimationOptions options);

  const Model& model;
  EstimationOptions options;
  std::vector<RunState> runs;
  std::vector<int> free;       // indices of the free parameters
  double total_scatter = 0.0;  // weighted, of the single cycles about their means
  long observations = 0;
  bool priors = false;       // at least one free parameter has a prior
  bool covariances = false;  // the data are Fourier coefficients

  // Recomputes what depends on the values of a run's data.
  void load(std::size_t run);
  // Moves the observed coordinate by `share` of the way from its present state to the data's first
  // harmonics. The other coordinates stay. Returns false if the data give no such start.
  bool start_from_data(std::size_t run, PeriodicSystem& system, double share = 1.0);

  double motion(std::size_t run) const;  // root mean square about the mean; 0: no motion
  // Root mean square of data less solution, divided by motion(); 0 for Fourier coefficients.
  double misfit(std::size_t run, const PeriodicSystem& system) const;
  double worst_misfit(const std::vector<PeriodicSystem>& systems) const;
  // True if a run's solution is far from its data.
  bool fitted_badly(const std::vector<PeriodicSystem>& systems) const;
  // True if the data repeat only after all their periods but the solution repeats sooner.
  bool lost_subharmonic(std::size_t run, const PeriodicSystem& system) const;
  double squares() const;  // weighted, of all data
  // Sum of squares of (theta - mean) / standard deviation.
  double prior_sum(const std::vector<double>& theta) const;
  // Variance of an observation of weight 1: known, or from a sum of squared residuals.
  double noise_variance(double sum_of_squares) const;

  // Calls visit(row, residual, inverse variance) for every datum of a run. row[0] is the Newton
  // step of the datum, row[1 + k] its derivative with respect to theta_k.
  template <class Visit>
  void for_each_datum(std::size_t run, const PeriodicSystem& system, bool with_newton,
                      Visit visit) const;

 private:
  template <class Visit>
  void for_each_coefficient(std::size_t run, const PeriodicSystem& system, bool with_newton,
                            Visit visit) const;
  mutable std::vector<double> mixed_;      // a row interpolated between grid points, 1 + p
  mutable std::vector<double> projected_;  // rows of all coefficients, (2 + p) x m
};

template <class Visit>
void FitData::for_each_coefficient(std::size_t r, const PeriodicSystem& system, bool with_newton,
                                   Visit visit) const {
  const RunState& run = runs[r];
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
void FitData::for_each_datum(std::size_t r, const PeriodicSystem& system, bool with_newton,
                             Visit visit) const {
  const RunState& run = runs[r];
  if (run.harmonic()) return for_each_coefficient(r, system, with_newton, visit);
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
