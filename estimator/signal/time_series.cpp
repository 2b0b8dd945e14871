#include "estimator/signal/time_series.hpp"

#include <algorithm>
#include <complex>
#include <numbers>

#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

// Of the squares by which the worst of the best periods differs from a cycle: noise varies less, a
// table that ramps down differs by far more.
constexpr double kAlike = 2.0;

}  // namespace

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
  const std::complex<double> phase = fourier_sum(mean, 1);
  const auto in_phase = [&](double begin) {
    const auto y = series.periods(begin, period, 1, mean.size());
    return begin + std::arg(phase / fourier_sum(y, 1)) / (2.0 * std::numbers::pi) * period;
  };
  double begin = in_phase(range.last - 1.5 * period);
  while (begin + period > range.last)
    begin -= period;
  std::vector<double> begins, squares;  // of each period, the last first; how it differs
  for (; begin >= range.first + 0.5 * period; begin = begins.back() - period) {
    begins.push_back(std::min(in_phase(begin), range.last - period));
    const auto y = series.periods(begins.back(), period, 1, mean.size());
    squares.push_back(0.0);
    for (std::size_t i = 0; i < y.size(); ++i)
      squares.back() += (y[i] - mean[i]) * (y[i] - mean[i]);
  }
  const auto wanted = static_cast<std::ptrdiff_t>(count);
  std::vector<double> worst;  // of `count` periods
  for (auto first = squares.begin(); squares.end() - first >= wanted; ++first)
    worst.push_back(*std::max_element(first, first + wanted));
  if (worst.empty()) return range.last;
  const double most = kAlike * *std::ranges::min_element(worst);
  const auto last = std::ranges::find_if(worst, [&](double d) { return d <= most; });
  return begins[static_cast<std::size_t>(last - worst.begin() + wanted - 1)];
}

}  // namespace shaker::estimator
