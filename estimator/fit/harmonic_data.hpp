// Cycles as Fourier coefficients, with the covariance from their scatter.
//
// The noise of resampled cycles is never white because of interpolation, filters and drift. A
// least-squares fit that assumes white noise gives wrong uncertainties. The coefficients of the
// mean cycle, weighted by the inverse of their cycle-to-cycle covariance, do not need this
// assumption: the cycles must only be independent. A few coefficients contain all information of a
// smooth response.
#pragma once

#include <span>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

// Returns mean, cos 1, sin 1, cos 2, ... (`count` values, odd) of one period on equal steps.
std::vector<double> fourier_coefficients(std::span<const double> samples, std::size_t count);

// Returns the largest number of coefficients whose covariance `cycles` cycles determine well (two
// degrees of freedom for each): odd, at most 1 + 2 * harmonics. Below 3 there are too few cycles.
std::size_t coefficients_for(long cycles, int harmonics);

// Mean and covariance of the coefficients, updated with each cycle (Welford). Use it from one
// thread; add() does not allocate.
class HarmonicMean {
 public:
  explicit HarmonicMean(std::size_t count);
  // Adds one whole period on equal steps, at least `count` points.
  void add(std::span<const double> displacement);

  long cycles() const { return cycles_; }
  const std::vector<double>& mean() const { return mean_; }
  // Covariance of the mean, count x count; needs at least two cycles.
  std::vector<double> covariance() const;
  // Sets the coefficients of `run`, their covariance and the cycles, and clears its samples. The
  // excitation does not change.
  void into(RunData& run) const;

 private:
  long cycles_ = 0;
  std::vector<double> mean_, now_, products_;
};

}  // namespace shaker::estimator
