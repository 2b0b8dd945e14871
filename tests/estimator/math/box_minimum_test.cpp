#include "estimator/math/box_minimum.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd box_minimum(const MatrixXd& a, const VectorXd& b, const VectorXd& low,
                     const VectorXd& high) {
  VectorXd x;
  estimator::box_minimum<Eigen::Dynamic>(a, b, low, high, 0.0, x);
  return x;
}

double value(const MatrixXd& a, const VectorXd& b, const VectorXd& x) {
  return 0.5 * x.dot(a * x) - b.dot(x);
}

// The minimum over every combination of active bounds.
double least_of_all(const MatrixXd& a, const VectorXd& b, const VectorXd& low,
                    const VectorXd& high) {
  const Index n = b.size();
  const auto choices = static_cast<int>(std::pow(3, n));
  double least = std::numeric_limits<double>::infinity();
  for (int choice = 0; choice < choices; ++choice) {
    MatrixXd m = a;
    VectorXd right = b;
    for (Index k = 0, rest = choice; k < n; ++k, rest /= 3) {
      if (rest % 3 == 0) continue;
      m.row(k).setZero();
      m(k, k) = 1.0;
      right[k] = rest % 3 == 1 ? low[k] : high[k];
    }
    const VectorXd x = m.fullPivLu().solve(right);
    if (((x - low).array() < -1e-9).any() || ((high - x).array() < -1e-9).any()) continue;
    least = std::min(least, value(a, b, x));
  }
  return least;
}

TEST(BoxMinimum, IsTheBestOfAllChoicesOfBounds) {
  std::mt19937_64 source(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    constexpr Index n = 5;
    MatrixXd root(n, n);
    VectorXd b(n), low(n), high(n);
    for (Index i = 0; i < n; ++i) {
      b[i] = 3.0 * normal(source);
      low[i] = trial % 4 == 0 && i == 2 ? 0.0 : -std::fabs(normal(source));
      high[i] = std::fabs(normal(source));
      for (Index j = 0; j < n; ++j)
        root(i, j) = normal(source);
    }
    // As badly conditioned as with similar parameters.
    root.col(1) = root.col(0) + 1e-3 * root.col(1);
    const MatrixXd a = root.transpose() * root + 1e-9 * MatrixXd::Identity(n, n);
    const VectorXd x = box_minimum(a, b, low, high);
    EXPECT_TRUE(((x - low).array() >= 0.0).all() && ((high - x).array() >= 0.0).all());
    const double least = least_of_all(a, b, low, high);
    EXPECT_NEAR(value(a, b, x), least, 1e-7 * (1.0 + std::fabs(least)));
  }
}

TEST(BoxMinimum, WithoutBoundsIsTheSolution) {
  const double infinite = std::numeric_limits<double>::infinity();
  MatrixXd a(2, 2);
  a << 4.0, 1.0, 1.0, 3.0;
  const VectorXd b = VectorXd::Ones(2);
  const VectorXd x =
      box_minimum(a, b, VectorXd::Constant(2, -infinite), VectorXd::Constant(2, infinite));
  EXPECT_NEAR(x[0], 2.0 / 11.0, 1e-15);
  EXPECT_NEAR(x[1], 3.0 / 11.0, 1e-15);
}

TEST(BoxMinimum, IsTheSameOnTheStack) {
  MatrixXd a(2, 2);
  a << 1.0, 0.9, 0.9, 1.0;
  const VectorXd b = (VectorXd(2) << 1.0, -0.2).finished();
  const VectorXd low = (VectorXd(2) << -2.0, 0.0).finished();
  const VectorXd high = (VectorXd(2) << 0.1, 3.0).finished();
  const VectorXd x = box_minimum(a, b, low, high);
  EXPECT_NEAR(x[0], 0.1, 1e-15);
  EXPECT_NEAR(x[1], 0.0, 1e-15);
  const BoxMatrix<8> small = a;
  BoxVector<8> few;
  EXPECT_TRUE(estimator::box_minimum<8>(small, b, low, high, 1e-13, few));
  EXPECT_EQ(few[0], x[0]);
  EXPECT_EQ(few[1], x[1]);
}

TEST(BoxMinimum, SaysThatTwoFreeOnesAreNotToldApart) {
  const BoxMatrix<8> alike = BoxMatrix<8>::Ones(2, 2);
  const BoxVector<8> b = BoxVector<8>::Ones(2), far = BoxVector<8>::Constant(2, 9.0);
  BoxVector<8> x;
  EXPECT_FALSE(estimator::box_minimum<8>(alike, b, -far, far, 1e-13, x));
  // With one of them held, the minimum is unique.
  BoxVector<8> low = -far;
  low[0] = 0.0;
  BoxVector<8> high = far;
  high[0] = 0.0;
  EXPECT_TRUE(estimator::box_minimum<8>(alike, BoxVector<8>(-b), low, high, 1e-13, x));
  EXPECT_EQ(x[0], 0.0);
  EXPECT_NEAR(x[1], -1.0, 1e-15);
}

// What the data see of a parameter differs by orders of magnitude, and its unit is anyone's choice.
TEST(DampedBoxStep, IsThatOfTheDampedEquationsInAnyUnit) {
  MatrixXd gram(3, 3);
  gram << 4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0;
  const VectorXd gradient = (VectorXd(3) << 1.0, -2.0, 6.0).finished();
  const VectorXd far = VectorXd::Constant(3, 10.0);
  constexpr double kDamping = 0.3;
  MatrixXd damped = gram;
  damped.diagonal() *= 1.0 + kDamping;
  const VectorXd expected = damped.ldlt().solve(gradient);
  const VectorXd unit = (VectorXd(3) << 1e-5, 1.0, 1e7).finished();
  const VectorXd step =
      damped_box_step(unit.asDiagonal() * gram * unit.asDiagonal(), unit.cwiseProduct(gradient),
                      -far.cwiseQuotient(unit), far.cwiseQuotient(unit), kDamping);
  for (Index k = 0; k < 3; ++k)
    EXPECT_NEAR(step[k] * unit[k], expected[k], 1e-13);
}

TEST(DampedBoxStep, EndsExactlyAtABoundAndIgnoresWhatTheDataDoNotSee) {
  const MatrixXd gram = (VectorXd(3) << 7.0, 0.3, 0.0).finished().asDiagonal();
  const VectorXd gradient = (VectorXd(3) << 70.0, -0.03, 0.0).finished();
  const VectorXd high = (VectorXd(3) << 1.1, 0.7, 5.0).finished();
  const VectorXd low = (VectorXd(3) << -1.0, -0.07, -5.0).finished();
  const VectorXd step = damped_box_step(gram, gradient, low, high, 1e-3);
  EXPECT_EQ(step[0], high[0]);
  EXPECT_EQ(step[1], low[1]);
  EXPECT_EQ(step[2], 0.0);
  BoxVector<8> few;
  EXPECT_TRUE(damped_box_step<8>(BoxMatrix<8>(gram), gradient, low, high, 1e-3, 0.0, few));
  EXPECT_EQ(few[0], high[0]);
  EXPECT_EQ(few[1], low[1]);
}

}  // namespace
}  // namespace shaker::estimator
