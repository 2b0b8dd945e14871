#include "estimator/signal/time_series.hpp"

#include <algorithm>
#include <complex>
#include <numbers>
#include <numeric>

#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

// Of the squares by which the best periods differ from a cycle: noise varies less, a table that
// ramps down differs by far more.
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
  // The k-th period from the end. Either side keeps half a period for the phase.
  const auto begin_of = [&](std::size_t k) {
    const double begin = range.last - (1.5 + static_cast<double>(k)) * period;
    const double turn =
        std::arg(phase / fourier_sum(series.periods(begin, period, 1, mean.size()), 1));
    return begin + turn / (2.0 * std::numbers::pi) * period;
  };
  const double length = (range.last - range.first) / period;
  const auto wanted = static_cast<std::size_t>(count);
  std::vector<double> squares;  // by which each period differs from the cycle
  for (std::size_t k = 0; static_cast<double>(k) + 2.0 <= length; ++k) {
    const std::vector<double> y = series.periods(begin_of(k), period, 1, mean.size());
    squares.push_back(0.0);
    for (std::size_t i = 0; i < y.size(); ++i)
      squares.back() += (y[i] - mean[i]) * (y[i] - mean[i]);
  }
  std::vector<double> differ;  // the same of `count` periods
  for (std::size_t k = 0; k + wanted <= squares.size(); ++k)
    differ.push_back(std::accumulate(squares.begin() + static_cast<std::ptrdiff_t>(k),
                                     squares.begin() + static_cast<std::ptrdiff_t>(k + wanted),
                                     0.0));
  if (differ.empty()) return range.last;
  const double most = kAlike * *std::ranges::min_element(differ);
  const auto last = std::ranges::find_if(differ, [&](double d) { return d <= most; });
  return begin_of(static_cast<std::size_t>(last - differ.begin()) + wanted - 1);
}

}  // namespace shaker::estimator
