#include "estimator/diagnosis/cycles/jump_sampling.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kDeviationsOfMedian = 1.48;  // of a normal number's size
// Standard deviations of B_1(x) and B_2(x) / 2, where x is anywhere in [0, 1): the first terms of the
// Euler-Maclaurin formula, by which a sum over samples misses an integral over a jump.
const double kFirst = 1.0 / std::sqrt(12.0), kSecond = 0.5 / std::sqrt(180.0);

// Of points on a circle of length 1.
double largest_gap(std::vector<double> points) {
  if (points.empty()) return 1.0;
  for (double& point : points)
    point -= std::floor(point);
  std::sort(points.begin(), points.end());
  double gap = points.front() + 1.0 - points.back();
  for (std::size_t i = 1; i < points.size(); ++i)
    gap = std::max(gap, points[i] - points[i - 1]);
  return gap;
}

}  // namespace

double JumpSampling::most() const {
  if (jumps.empty()) return 0.0;
  double squares = 0.0;
  for (const double jump : jumps)
    squares += jump * jump;
  return std::sqrt(0.5 * squares) / static_cast<double>(jumps.size());
}

Eigen::MatrixXd JumpSampling::covariance_of_mean(Eigen::Index size) const {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  const auto n = static_cast<double>(jumps.size());
  const double gap = largest_gap(offsets);
  const Eigen::Index harmonics = (size - 1) / 2;
  Eigen::VectorXd moved(size);
  for (std::size_t k = 0; k < jumps.size(); ++k) {
    if (jumps[k] == 0.0) continue;
    fill_harmonic_row((static_cast<double>(k) + 0.5) / n,
                      {moved.data(), static_cast<std::size_t>(size)});
    moved[0] *= 0.5;  // a mean is half an amplitude
    const double by = 2.0 * jumps[k] / n * gap * kFirst;
    covariance += by * by * moved * moved.transpose();
    Eigen::VectorXd turned = Eigen::VectorXd::Zero(size);
    for (Eigen::Index h = 1; h <= harmonics; ++h) {
      turned[2 * h - 1] = -kTwoPi * static_cast<double>(h) * moved[2 * h];
      turned[2 * h] = kTwoPi * static_cast<double>(h) * moved[2 * h - 1];
    }
    const double next = 2.0 * jumps[k] / n * (gap / n) * gap * kSecond;
    covariance += next * next * turned * turned.transpose();
  }
  return covariance;
}

LeftByHarmonics::LeftByHarmonics(double samples_a_cycle, int harmonics)
    : sum_(std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(samples_a_cycle)))),
      count_(sum_.size()),
      followed_((2.0 * harmonics + 1.0) / static_cast<double>(sum_.size())) {}

void LeftByHarmonics::add(const std::vector<double>& tau, const Eigen::VectorXd& left) {
  const auto n = static_cast<double>(sum_.size());
  for (std::size_t i = 0; i < tau.size(); ++i) {
    const auto at = static_cast<std::size_t>(std::clamp(tau[i] * n, 0.0, n - 1.0));
    sum_[at] += left[static_cast<Eigen::Index>(i)];
    count_[at] += 1.0;
  }
}

std::vector<double> LeftByHarmonics::jumps() const {
  const std::size_t n = sum_.size();
  std::vector<double> mean(n), sizes(n), jumps(n);
  for (std::size_t k = 0; k < n; ++k) {
    mean[k] = count_[k] > 0.0 ? sum_[k] / count_[k] : 0.0;
    sizes[k] = std::fabs(mean[k]);
  }
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(n / 2), sizes.end());
  // The largest that noise makes of so many differences.
  const double noise = kDeviationsOfMedian * sizes[n / 2];
  const double of_noise = 2.0 * noise * noise * 2.0 * std::log(static_cast<double>(n));
  // Over two intervals, as the jump may be within one: so each is met twice. Across it the harmonics follow
  // a part, and of a coarse record too much of two.
  const bool two = followed_ < 0.25;
  const double left = 1.0 - followed_ * (two ? 2.0 : 1.0), times = two ? 2.0 : 1.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double over = mean[(k + 1) % n] - mean[two ? (k + n - 1) % n : k];
    jumps[k] = std::sqrt(std::max(0.0, (over * over - of_noise) / times)) / left;
  }
  return jumps;
}

}  // namespace shaker::estimator::diagnosis
