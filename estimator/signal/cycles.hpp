// Whole cycles of a record on equal steps, and their mean. A cycle is one period of the excitation.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace shaker::estimator {

// Consecutive whole cycles of a run, `points` values each.
struct Cycles {
  std::vector<double> y;
  std::size_t points = 0;
  std::size_t count() const { return points == 0 ? 0 : y.size() / points; }
};

// The phase of a time in its period, in [0, 1).
double phase_of(double t, double frequency_hz);

// The number of points in a period when the samples are at i / n of a period, from a whole
// period on; otherwise 0. `t` in s, increasing; here and below.
std::size_t points_of_equal_steps(const std::vector<double>& t, double frequency_hz);

// Whole cycles on equal steps: as recorded if the samples are on equal steps, otherwise
// resampled to 32 points by cubic interpolation. The resampled cycles are for checks, not for
// estimates. Empty when there are fewer than kMinSamplesForCubic samples in a period.
Cycles cycles_of(const std::vector<double>& t, const std::vector<double>& y, double frequency_hz);
inline constexpr double kMinSamplesForCubic = 8.0;

// The mean of whole cycles, and the sum of the squared deviations from it.
struct MeanCycle {
  std::vector<double> mean;
  double scatter = 0.0;
  double cycles = 0.0;  // that were averaged
  // Of a point of the mean, by the scatter of the cycles; 0 for fewer than two of them.
  double standard_error() const;
};
// `points`: in a cycle; a remainder of `y` is left out.
MeanCycle mean_cycle(std::span<const double> y, std::size_t points);

// The same of several channels that were sampled together. `scatter`: the sums of products of the
// channels' deviations, channels x channels, row by row; empty for one cycle.
struct MeanChannels {
  std::vector<std::vector<double>> mean;
  std::vector<double> scatter;
  double cycles = 0.0;
};
MeanChannels mean_channels(const std::vector<std::vector<double>>& channels, std::size_t points);

// A measured excitation of one cycle: samples on equal steps, m/s^2; empty: a cosine of `amplitude`.
struct CycleExcitation {
  double frequency_hz = 0.0, amplitude = 0.0;
  std::vector<double> samples;
  double error = 0.0;  // standard error of its harmonics, independent from cycle to cycle
};
CycleExcitation mean_excitation(const std::vector<CycleExcitation>& cycles);

}  // namespace shaker::estimator
