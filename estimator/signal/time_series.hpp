// Samples of one channel at any times, and whole periods of them on equal steps.
#pragma once

#include <cstddef>
#include <vector>

namespace shaker::estimator {

// In increasing time (s); at least two samples.
struct TimeSeries {
  std::vector<double> t, value;
  // Linear interpolation; the samples are much denser than the changes that they show.
  double at(double when) const;
  // `count` periods from the time `begin` on, `points` values each.
  std::vector<double> periods(double begin, double period, int count, std::size_t points) const;
};

struct TimeRange {
  double first = 0.0, last = 0.0;
};

// The begin of the last `count` periods within `range` that are like the cycle `mean`, and in phase
// with it by their fundamental: what a record holds after them, as a ramp to rest, is passed over.
// `range.last` where the range does not hold so many.
double begin_in_phase(const TimeSeries& series, const std::vector<double>& mean,
                      const TimeRange& range, double period, int count);

}  // namespace shaker::estimator
