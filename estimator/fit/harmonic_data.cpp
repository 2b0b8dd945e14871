#include "estimator/fit/harmonic_data.hpp"

#include <algorithm>

#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

void analyse(std::span<const double> samples, std::span<double> out) {
  const auto n = static_cast<int>(samples.size());
  for (std::size_t j = 0; j < out.size(); ++j) {
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
      sum += samples[static_cast<std::size_t>(i)] *
             ((j == 0 ? 1.0 : 2.0) * harmonic_term(static_cast<int>(j), i, n));
    out[j] = sum / n;
  }
}

}  // namespace

std::vector<double> fourier_coefficients(std::span<const double> samples, std::size_t count) {
  std::vector<double> out(count);
  analyse(samples, out);
  return out;
}

std::size_t coefficients_for(long cycles, int harmonics) {
  const long most = std::min<long>(1 + 2L * harmonics, (cycles - 1) / 2);
  return static_cast<std::size_t>(most > 0 ? most - (most % 2 == 0 ? 1 : 0) : 0);
}

HarmonicMean::HarmonicMean(std::size_t count)
    : mean_(count, 0.0), now_(count, 0.0), products_(count * count, 0.0) {}

void HarmonicMean::add(std::span<const double> displacement) {
  analyse(displacement, now_);
  ++cycles_;
  const double share = 1.0 / static_cast<double>(cycles_);
  const std::size_t m = mean_.size();
  for (std::size_t j = 0; j < m; ++j)
    now_[j] -= mean_[j];
  for (std::size_t j = 0; j < m; ++j) {
    for (std::size_t k = 0; k < m; ++k)
      products_[j * m + k] += (1.0 - share) * now_[j] * now_[k];
  }
  for (std::size_t j = 0; j < m; ++j)
    mean_[j] += share * now_[j];
}

std::vector<double> HarmonicMean::covariance() const {
  std::vector<double> out = products_;
  const auto n = static_cast<double>(cycles_);
  for (double& value : out)
    value /= (n - 1.0) * n;
  return out;
}

void HarmonicMean::into(RunData& run) const {
  run.displacement.clear();
  run.tau.clear();
  run.sample_weight.clear();
  run.scatter = 0.0;
  run.cycles = static_cast<double>(cycles_);
  run.harmonics = mean_;
  run.harmonic_covariance = covariance();
  run.covariance_degrees = static_cast<double>(cycles_ - 1);
}

}  // namespace shaker::estimator
