#include "daemon/cycles/resampler.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace shaker::daemon {
namespace {

constexpr std::size_t kFewest = 8;

struct Point {
  bool ok = false;
  double value = 0.0, sum_of_squares = 0.0, variance_factor = 0.0;
  long freedom = 0;
};

// Least-squares polynomial through samples [first, last), evaluated at `centre`.
template <int kTerms>
Point local_fit(std::span<const double> tau, std::span<const double> value, std::size_t first,
                std::size_t last, double centre, double reach) {
  using Vector = Eigen::Matrix<double, kTerms, 1>;
  using Matrix = Eigen::Matrix<double, kTerms, kTerms>;
  double moment[2 * kTerms - 1] = {};
  Vector b = Vector::Zero();
  const double base = value[first];  // keeps the squares small relative to the noise
  double square = 0.0;
  for (std::size_t i = first; i < last; ++i) {
    const double x = (tau[i] - centre) / reach, v = value[i] - base;
    double power = 1.0;
    for (int k = 0; k < 2 * kTerms - 1; ++k, power *= x) {
      moment[k] += power;
      if (k < kTerms) b[k] += power * v;
    }
    square += v * v;
  }
  Matrix a;
  for (int r = 0; r < kTerms; ++r) {
    for (int c = 0; c < kTerms; ++c)
      a(r, c) = moment[r + c];
  }
  const Eigen::LDLT<Matrix> factor(a);
  if (factor.info() != Eigen::Success ||
      !(factor.vectorD().minCoeff() > 1e-9 * factor.vectorD().maxCoeff()))
    return {};
  const Vector x = factor.solve(b);
  return {.ok = true,
          .value = base + x[0],
          .sum_of_squares = std::max(0.0, square - x.dot(b)),
          .variance_factor = factor.solve(Vector::Unit(0))[0],
          .freedom = static_cast<long>(last - first) - kTerms};
}

}  // namespace

Resampled resample(std::span<const double> tau, std::span<const double> value,
                   std::span<double> out) {
  Resampled result;
  if (tau.size() < kFewest) return result;
  const double reach = 1.0 / static_cast<double>(out.size());
  double squares = 0.0, factors = 0.0;
  long freedom = 0;
  std::size_t first = 0, last = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double centre = static_cast<double>(i) * reach;
    while (first < tau.size() && tau[first] < centre - reach)
      ++first;
    last = std::max(last, first);
    while (last < tau.size() && tau[last] <= centre + reach)
      ++last;
    Point point;
    if (last - first >= kFewest) {
      point = local_fit<4>(tau, value, first, last, centre, reach);
    } else {
      result.sparse = true;
      std::size_t low = first, high = last;
      while (high - low < kFewest) {
        const bool down =
            low > 0 && (high == tau.size() || centre - tau[low - 1] <= tau[high] - centre);
        down ? --low : ++high;
      }
      const double wide = std::max(centre - tau[low], tau[high - 1] - centre);
      if (tau[low] > centre || tau[high - 1] < centre) return {};
      point = local_fit<6>(tau, value, low, high, centre, wide);
    }
    if (!point.ok) return {};
    out[i] = point.value;
    squares += point.sum_of_squares;
    factors += point.variance_factor;
    freedom += point.freedom;
  }
  result.ok = true;
  result.sample_noise = std::sqrt(squares / static_cast<double>(freedom));
  result.point_noise = result.sample_noise * std::sqrt(factors / static_cast<double>(out.size()));
  return result;
}

StampFit smooth_stamps(std::span<const double> t, std::span<double> smooth,
                       std::span<double> scratch) {
  StampFit result;
  const std::size_t n = t.size();
  if (n < kFewest) return result;
  for (std::size_t i = 0; i + 1 < n; ++i)
    scratch[i] = t[i + 1] - t[i];
  const auto steps = scratch.first(n - 1);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((n - 1) / 2);
  std::ranges::nth_element(steps, middle);
  double interval = *middle, start = t[0];
  if (!(interval > 0.0)) return result;
  // Number of each sample on the regular clock: first from step to step, then from the line
  // itself.
  for (int pass = 0; pass < 3; ++pass) {
    double sk = 0.0, st = 0.0, skk = 0.0, skt = 0.0, k = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double step = i == 0 ? 0.0 : t[i] - t[i - 1];
      const double before = k;
      k = pass == 0 ? k + std::round(step / interval) : std::round((t[i] - start) / interval);
      if (pass > 0 && i > 0 && k <= before) return result;  // two samples in one place
      smooth[i] = k;
      sk += k;
      st += t[i];
    }
    const double mk = sk / static_cast<double>(n), mt = st / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      skk += (smooth[i] - mk) * (smooth[i] - mk);
      skt += (smooth[i] - mk) * (t[i] - mt);
    }
    if (!(skk > 0.0)) return result;
    interval = skt / skk;
    start = mt - mk * interval;
  }
  double squares = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    smooth[i] = start + smooth[i] * interval;
    squares += (t[i] - smooth[i]) * (t[i] - smooth[i]);
  }
  result.interval = interval;
  result.jitter = std::sqrt(squares / static_cast<double>(n)) / interval;
  // Uniformly distributed stamps have a jitter of 0.29: near that value there is no regular
  // clock.
  result.ok = result.jitter < 0.25;
  return result;
}

}  // namespace shaker::daemon
