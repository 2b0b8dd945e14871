#include "estimator/diagnosis/records/internal/spectral_floor.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kAboveFloor = 2.5;  // mean power of a window that holds a response
constexpr double kRounding = 3e-5;   // of the response: what no simulation can be held to
constexpr double kMostFreedom = 400.0;

double median_power(const VectorXd& series, Index from, Index to) {
  std::vector<double> power;
  for (Index k = from; k < to; ++k)
    power.push_back(series[k] * series[k]);
  const auto middle = power.begin() + static_cast<std::ptrdiff_t>(power.size() / 2);
  std::nth_element(power.begin(), middle, power.end());
  return *middle / 0.4549;  // the median of chi-squared with one degree of freedom
}

double least_power(const VectorXd& series, double size) {
  return std::pow(kRounding * size, 2) * 2.0 / static_cast<double>(series.size());
}

// The last window in which something rises above the floor, and two more.
void find_band(SpectralFloor& floor, const VectorXd& series) {
  const Index n = series.size();
  const Index window = std::max<Index>(16, n / 64);
  floor.band = 0;
  double sum = 0.0;
  for (Index k = n - 1; k >= 0; --k) {
    sum += series[k] * series[k] / floor.power[k];
    if (k + window < n) sum -= series[k + window] * series[k + window] / floor.power[k + window];
    if (k + window <= n && sum > kAboveFloor * static_cast<double>(window)) {
      floor.band = std::min(n, k + 2 * window);
      break;
    }
  }
  floor.band = std::min(n, std::max<Index>(floor.band, 16));
  floor.reached = floor.band < 3 * n / 4;
}

}  // namespace

SpectralFloor trend_floor(const VectorXd& series, double size) {
  const Index n = series.size();
  const auto end = static_cast<double>(n);
  const double least = least_power(series, size);
  const double level = std::max(median_power(series, 4 * n / 5, n), least);
  const double middle = std::max(median_power(series, 3 * n / 5, 4 * n / 5), least);
  double slope = 0.0;
  if (middle > 1.3 * level)
    slope = std::clamp(std::log(middle / level) / std::log(0.9 / 0.7), 0.0, 1.0);
  SpectralFloor floor;
  floor.power.resize(n);
  for (Index k = 0; k < n; ++k)
    floor.power[k] =
        level * std::pow(std::max(static_cast<double>(k), 0.05 * end) / (0.9 * end), -slope);
  floor.freedom = std::min(kMostFreedom, 0.2 * end);
  find_band(floor, series);
  return floor;
}

VectorXd upper_power(const SpectralFloor& floor) {
  return floor.power * (1.0 + 2.0 * std::sqrt(2.0 / floor.freedom));
}

}  // namespace shaker::estimator::diagnosis
