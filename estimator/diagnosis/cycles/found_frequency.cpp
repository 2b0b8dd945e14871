#include "estimator/diagnosis/cycles/internal/found_frequency.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace shaker::estimator::diagnosis {
namespace {

constexpr std::size_t kFewest = 16, kMost = 1U << 17U;  // samples
constexpr double kFewestPeriods = 3.0;
constexpr double kOfPower = 0.3;  // in the line: less is a record of many frequencies
constexpr int kHalvings = 40;

// Power of the windowed samples at one frequency.
double power_at(const std::vector<double>& t, const std::vector<double>& y, double f) {
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i)
    sum += y[i] * std::polar(1.0, -2.0 * std::numbers::pi * f * (t[i] - t.front()));
  return std::norm(sum);
}

// The least length from n on that a fast transform splits into small factors.
std::size_t padded(std::size_t n) {
  n = (n + 3) / 4 * 4;
  for (;; n += 4) {
    std::size_t rest = n;
    for (const std::size_t factor : {2U, 3U, 5U}) {
      while (rest % factor == 0)
        rest /= factor;
    }
    if (rest == 1) return n;
  }
}

}  // namespace

std::optional<double> found_frequency(const std::vector<double>& t, const std::vector<double>& y) {
  if (t.size() < kFewest || t.size() != y.size()) return std::nullopt;
  const std::size_t n = std::min(t.size(), kMost);
  const double length = t[n - 1] - t.front();
  if (!(length > 0.0)) return std::nullopt;
  // Hann's window: a ramp, a drift and the ends of the record leak little.
  const std::vector<double> times(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(n));
  std::vector<double> windowed(padded(n));
  double mean = 0.0;
  for (std::size_t i = 0; i < n; ++i)
    mean += y[i] / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double share = (times[i] - times.front()) / length;
    windowed[i] = (y[i] - mean) * 0.5 * (1.0 - std::cos(2.0 * std::numbers::pi * share));
  }
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> spectrum;
  fft.fwd(spectrum, windowed);
  const std::size_t wide = windowed.size();
  windowed.resize(n);
  std::size_t best = 1;
  double all = 0.0;
  for (std::size_t k = 1; k < wide / 2; ++k) {
    all += std::norm(spectrum[k]);
    if (std::norm(spectrum[k]) > std::norm(spectrum[best])) best = k;
  }
  double line = 0.0;
  for (std::size_t k = std::max<std::size_t>(best, 3) - 2; k <= std::min(best + 2, wide / 2); ++k)
    line += std::norm(spectrum[k]);
  const double step = static_cast<double>(n - 1) / static_cast<double>(wide) / length;  // Hz
  const double periods = static_cast<double>(best * n) / static_cast<double>(wide);
  if (!(line > kOfPower * all) || periods < kFewestPeriods) return std::nullopt;
  // The maximum between the neighbours, by golden section.
  constexpr double kGolden = 0.6180339887498949;
  double low = (static_cast<double>(best) - 1.0) * step;
  double high = (static_cast<double>(best) + 1.0) * step;
  double one = high - kGolden * (high - low), two = low + kGolden * (high - low);
  double at_one = power_at(times, windowed, one), at_two = power_at(times, windowed, two);
  for (int i = 0; i < kHalvings && high - low > 1e-3 * step; ++i) {
    if (at_one > at_two) {
      high = two;
      two = one;
      at_two = at_one;
      one = high - kGolden * (high - low);
      at_one = power_at(times, windowed, one);
    } else {
      low = one;
      one = two;
      at_one = at_two;
      two = low + kGolden * (high - low);
      at_two = power_at(times, windowed, two);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace shaker::estimator::diagnosis
