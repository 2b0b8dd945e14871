// A trigonometric polynomial through samples at any phases of a period, by least squares.
#pragma once

#include <vector>

#include "estimator/signal/cycles.hpp"

namespace shaker::estimator {

struct HarmonicCurve {
  std::vector<double> coefficients;  // 1 + 2 * harmonics, as in math/harmonic_basis.hpp
  double residual = 0.0;             // sum of squares
  // The curve at `points` equal steps of the period.
  std::vector<double> on_grid(std::size_t points) const;
};
// `tau`: phases of `y`, in periods. The memory does not grow with the samples. Of several curves
// that fit equally well: the one with the shortest vector of coefficients.
HarmonicCurve fit_harmonics(const std::vector<double>& tau, const std::vector<double>& y,
                            int harmonics);

// The excitation on equal steps: harmonics 1 to 8 without the mean. The residual is the
// accelerometer's noise and gives the error of the result.
CycleExcitation fit_excitation(const std::vector<double>& tau, const std::vector<double>& x);

// The mean of groups of `periods` cycles, each of which begins in the same phase of the
// excitation: at the samples on equal steps, otherwise at as many points as coefficients. When the
// samples are spread over the whole period, the errors of those points are independent, and each
// is the mean of count / n samples.
struct GroupMean {
  MeanCycle group;         // empty when the samples show fewer harmonics than kMinHarmonicsOfGroup
  double harmonics = 0.0;  // of the excitation, that the samples determine
};
inline constexpr int kMinHarmonicsOfGroup = 8;  // fewer would hide part of the response
// From the first whole period in `t` (s) on. `cycles`: the record's, by cycles_of().
GroupMean mean_of_groups(const std::vector<double>& t, const std::vector<double>& y,
                         double frequency_hz, const Cycles& cycles, int periods);

}  // namespace shaker::estimator
