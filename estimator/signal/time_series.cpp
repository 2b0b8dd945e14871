#include "estimator/signal/time_series.hpp"

#include <algorithm>
#include <complex>
#include <numbers>

#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {

double TimeSeries::at(double when) const {
  const auto next = std::upper_bound(t.begin() + 1, t.end() - 1, when);
  const auto k = static_cast<std::size_t>(next - t.begin());
  const double share = (when - t[k - 1]) / (t[k] - t[k - 1]);
  return value[k - 1] + share * (value[k] - value[k - 1]);
}

std::vector<double> TimeSeries::periods(double begin, double period, int count,
                                        std::size_t points) const {
  std::vector<double> out;
  for (std::size_t i = 0; i < points * static_cast<std::size_t>(count); ++i)
    out.push_back(at(begin + period * static_cast<double>(i) / static_cast<double>(points)));
  return out;
}

double begin_in_phase(const TimeSeries& series, const std::vector<double>& mean,
                      const TimeRange& range, double period, int count) {
  double begin = range.last - (count + 1) * period;
  const double turn = std::arg(fourier_sum(mean, 1) /
                               fourier_sum(series.periods(begin, period, 1, mean.size()), 1));
  begin += turn / (2.0 * std::numbers::pi) * period;
  while (begin + count * period > range.last)
    begin -= period;
  while (begin < range.first)
    begin += period;
  return begin;
}

}  // namespace shaker::estimator
