// Cycles as Fourier coefficients with the covariance that their scatter shows.
//
// Resampled cycles are never white: interpolation, filters and drift colour their noise, and a
// least-squares fit that takes it for white understates what it is worth. The coefficients of the
// mean cycle, weighed by the inverse of their own cycle-to-cycle covariance, need no such
// assumption: cycles only have to be independent of each other. A handful of numbers holds all that
// a smooth response says.
#pragma once

#include <span>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

// Mean, cos 1, sin 1, cos 2, ... (`count` of them, odd) of one period on equal steps.
std::vector<double> fourier_coefficients(std::span<const double> samples, std::size_t count);

// The most coefficients that `cycles` cycles can weigh with room to spare (two degrees of freedom
// of the covariance for each), odd, at most 1 + 2 * harmonics; less than 3: too few cycles.
std::size_t coefficients_for(long cycles, int harmonics);

// Mean and covariance of the coefficients, cycle by cycle (Welford). One thread; allocates only in
// the constructor and in `into`.
class HarmonicMean {
 public:
  explicit HarmonicMean(std::size_t count);
  // One whole period on equal steps, at least `count` points.
  void add(std::span<const double> displacement);

  long cycles() const { return cycles_; }
  const std::vector<double>& mean() const { return mean_; }
  // Of the mean, count x count; needs two cycles.
  std::vector<double> covariance() const;
  // Fills in what a RunData holds of it and clears its samples; the excitation is the caller's.
  void into(RunData& run) const;

 private:
  long cycles_ = 0;
  std::vector<double> mean_, now_, products_;
};

}  // namespace shaker::estimator
