#include "estimator/diagnosis/cycles/jump_sampling.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kDeviationsOfMedian = 1.48;  // of a normal number's size
constexpr double kSureJump = 2.0;             // of a square, times the largest that noise makes
constexpr int kFewPhases = 4;                 // of a sampling interval: more average the error away
// Standard deviation of where a jump lies within a step, in steps: by it a sum over samples misses the
// integral (Euler and Maclaurin's first term), and as far the jump may be from the middle of the step.
const double kFirst = 1.0 / std::sqrt(12.0), kSecond = 0.5 * kFirst;

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

// The means of what is left at phases in equal steps, and the noise of their differences: the largest of
// so many, squared.
struct LeftCourse {
  std::vector<double> mean;
  double noise = 0.0;
  double offset = 0.0;  // of the phases, in steps
  double step(std::size_t k) const { return mean[(k + 1) % mean.size()] - mean[k]; }
};

LeftCourse course_of(const std::vector<double>& tau, const std::vector<double>& left,
                     double steps) {
  const auto n = std::max<std::size_t>(4, static_cast<std::size_t>(std::lround(steps)));
  std::vector<double> count(n), sizes;
  // From the first phase on: those that all cycles share lie in one step.
  const double first = tau.empty() ? 0.0 : tau.front() * static_cast<double>(n);
  LeftCourse course{std::vector<double>(n), 0.0, first};
  for (std::size_t i = 0; i < tau.size(); ++i) {
    const double at = tau[i] * static_cast<double>(n) - first;
    const auto step = static_cast<std::size_t>(std::lround(at) + 2 * static_cast<long>(n)) % n;
    course.mean[step] += left[i];
    count[step] += 1.0;
    course.offset += (at - std::round(at)) / static_cast<double>(tau.size());
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (count[k] > 0.0) course.mean[k] /= count[k];
    sizes.push_back(std::fabs(course.mean[k]));
  }
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(n / 2), sizes.end());
  const double noise = kDeviationsOfMedian * sizes[n / 2];
  course.noise = 2.0 * noise * noise * 2.0 * std::log(static_cast<double>(n));
  return course;
}

// Of a jump that lies anywhere. Over two steps, as it may be within one, so that each is met twice; of a
// coarse record the harmonics follow too much of two.
double most_of(const LeftCourse& course, double followed) {
  const std::size_t n = course.mean.size();
  const bool two = followed < 0.25;
  const double left = 1.0 - followed * (two ? 2.0 : 1.0);
  double squares = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double over = course.step(k) + (two ? course.step((k + n - 1) % n) : 0.0);
    squares += std::max(0.0, over * over - course.noise) / (two ? 2.0 : 1.0);
  }
  return std::sqrt(0.5 * squares) / left / static_cast<double>(n);
}

// A course that goes over several steps is no jump: a sum over samples hardly misses it.
std::vector<double> jumps_of(const LeftCourse& course, double followed) {
  const std::size_t n = course.mean.size();
  std::vector<double> jumps(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double step = course.step(k);
    if (step * step < kSureJump * course.noise) continue;
    double beside = 0.0;
    for (const std::size_t next : {(k + n - 1) % n, (k + 1) % n})
      beside += std::max(0.0, std::copysign(1.0, step) * course.step(next));
    jumps[k] = std::max(0.0, std::fabs(step) - beside) / (1.0 - followed);
  }
  return jumps;
}

}  // namespace

Eigen::MatrixXd JumpSampling::covariance_of_mean(Eigen::Index size) const {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  const auto n = static_cast<double>(jumps.size());
  Eigen::VectorXd moved(size), turned(size);
  for (std::size_t k = 0; k < jumps.size(); ++k) {
    if (jumps[k] == 0.0) continue;
    fill_harmonic_row((static_cast<double>(k) + 0.5 + first_phase) / n,
                      {moved.data(), static_cast<std::size_t>(size)});
    moved[0] *= 0.5;  // a mean is half an amplitude
    turned.setZero();
    for (Eigen::Index h = 1; h <= (size - 1) / 2; ++h) {
      turned[2 * h - 1] = -kTwoPi * static_cast<double>(h) * moved[2 * h];
      turned[2 * h] = kTwoPi * static_cast<double>(h) * moved[2 * h - 1];
    }
    const double first = kFirst * 2.0 * jumps[k] / n, second = kSecond * 2.0 * jumps[k] / n / n;
    covariance += first * first * moved * moved.transpose();
    covariance += second * second * turned * turned.transpose();
  }
  return covariance;
}

void LeftByHarmonics::add(const std::vector<double>& tau, const Eigen::VectorXd& left) {
  offsets_.push_back(tau.front() * samples_);
  tau_.insert(tau_.end(), tau.begin(), tau.end());
  left_.insert(left_.end(), left.data(), left.data() + left.size());
}

JumpSampling LeftByHarmonics::sampling() const {
  const double followed = (2.0 * harmonics_ + 1.0) / samples_;
  JumpSampling sampling;
  sampling.offsets = offsets_;
  sampling.most = most_of(course_of(tau_, left_, samples_), followed);
  const double phases = std::round(1.0 / largest_gap(offsets_));
  if (phases > kFewPhases) return sampling;
  const LeftCourse course = course_of(tau_, left_, phases * samples_);
  sampling.jumps = jumps_of(course, followed / phases);
  sampling.first_phase = course.offset;
  return sampling;
}

}  // namespace shaker::estimator::diagnosis
