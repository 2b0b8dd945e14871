// A prior of the parameters of a record, against the normal equations.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "estimator/fit/records/transient.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

// u0 = 1, v0 = 0, c = 0.25, k = 7.5 in closed form.
double freed_at(double t) {
  const double omega = std::sqrt(7.5 - 0.25 * 0.25 * 0.25);
  return std::exp(-0.125 * t) * (std::cos(omega * t) + 0.125 / omega * std::sin(omega * t));
}

// A free decay at known parameters and noise: the normal equations by hand.
TEST(TransientPrior, IsOneMoreRowOfTheLeastSquares) {
  const Model model(linear_oscillator());
  std::vector<double> t, y;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (int i = 0; i < 60; ++i) {
    t.push_back(0.05 * i);
    y.push_back(freed_at(t.back()) + noise(random));
  }
  TransientRecord record;
  record.t = t;
  record.displacement = y;
  record.initial = {{1.0, true}, {0.0, true}};
  TransientEstimator alone(model, {record});
  const auto free = alone.fit({0.25, 7.5});
  ASSERT_EQ(free.status, FitStatus::converged);
  const auto slopes = alone.sensitivities(0);
  // The prior is strongly correlated and a few of its errors away.
  const double mean[] = {0.3, 7.3}, v[] = {0.01, 0.018, 0.018, 0.04}, s = 0.01;
  TransientOptions options;
  options.prior = TransientPrior{{mean[0], mean[1]}, {v[0], v[1], v[2], v[3]}, s};
  TransientEstimator with(model, {record}, options);
  const auto& fit = with.fit({0.25, 7.5});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  const double det = v[0] * v[3] - v[1] * v[2];
  double a[] = {v[3] / det, -v[1] / det, -v[2] / det, v[0] / det};  // inverse covariance
  double b[] = {a[0] * (mean[0] - free.theta[0]) + a[1] * (mean[1] - free.theta[1]),
                a[2] * (mean[0] - free.theta[0]) + a[3] * (mean[1] - free.theta[1])};
  for (std::size_t i = 0; i < t.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k)
      a[k] += slopes[2 * i + k / 2] * slopes[2 * i + k % 2] / (s * s);
  }
  const double all = a[0] * a[3] - a[1] * a[2];
  const double step[] = {(a[3] * b[0] - a[1] * b[1]) / all, (a[0] * b[1] - a[2] * b[0]) / all};
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_NEAR(fit.theta[k] - free.theta[k], step[k], 0.03 * std::fabs(step[k]));
  EXPECT_NEAR(fit.covariance[0], a[3] / all, 0.02 * a[3] / all);
  EXPECT_NEAR(fit.covariance[3], a[0] / all, 0.02 * a[0] / all);
  EXPECT_GT(fit.prior_sum, 0.0);
  options.prior->mean.pop_back();
  EXPECT_THROW(TransientEstimator(model, {record}, options), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
