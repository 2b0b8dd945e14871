// Compared with Eigen's pivoted factorisation.
#include "estimator/solve/time/internal/lane_inverse.hpp"

#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

using Eigen::MatrixXd;

// Each lane's error of A * inverse(A) against the identity; empty where invert() says singular.
std::vector<double> errors(const std::vector<MatrixXd>& matrices) {
  const int n = static_cast<int>(matrices.size()), size = static_cast<int>(matrices[0].rows());
  LaneInverse lanes;
  lanes.shape(n, size);
  for (int i = 0; i < n; ++i) {
    for (int d = 0; d < size; ++d) {
      for (int e = 0; e < size; ++e)
        lanes.entry(d, e)[i] = matrices[static_cast<std::size_t>(i)](d, e);
    }
  }
  if (!lanes.invert(n)) return {};
  std::vector<double> worst;
  for (int i = 0; i < n; ++i) {
    MatrixXd inverse(size, size);
    for (int d = 0; d < size; ++d) {
      for (int e = 0; e < size; ++e)
        inverse(d, e) = lanes.entry(d, e)[i];
    }
    const MatrixXd& matrix = matrices[static_cast<std::size_t>(i)];
    const MatrixXd exact = matrix.fullPivLu().inverse();
    worst.push_back((inverse - exact).norm() / exact.norm());
  }
  return worst;
}

MatrixXd random_matrix(int size, std::mt19937& random) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(size, size, [&] { return normal(random); });
}

TEST(LaneInverse, IsThatOfEveryLane) {
  std::mt19937 random(1);
  for (int size = 1; size <= 5; ++size) {
    std::vector<MatrixXd> matrices;
    for (int i = 0; i < 13; ++i)
      matrices.push_back(random_matrix(size, random) + 4.0 * MatrixXd::Identity(size, size));
    for (const double error : errors(matrices))
      EXPECT_LT(error, 1e-12) << size;
  }
}

TEST(LaneInverse, ExchangesRowsWhereALaneNeedsIt) {
  std::mt19937 random(2);
  for (int size = 2; size <= 5; ++size) {
    std::vector<MatrixXd> matrices;
    for (int i = 0; i < 9; ++i) {
      matrices.push_back(random_matrix(size, random) + 4.0 * MatrixXd::Identity(size, size));
      if (i == 4) matrices.back() = matrices.back().rowwise().reverse().eval();
      if (i == 5) matrices.back()(0, 0) = 0.0;
    }
    const auto worst = errors(matrices);
    ASSERT_EQ(worst.size(), matrices.size()) << size;
    for (const double error : worst)
      EXPECT_LT(error, 1e-11) << size;
  }
}

TEST(LaneInverse, RefusesASingularLane) {
  std::mt19937 random(3);
  std::vector<MatrixXd> matrices(4, MatrixXd::Identity(3, 3));
  matrices[2] = random_matrix(3, random);
  matrices[2].row(2) = matrices[2].row(0) + matrices[2].row(1);
  EXPECT_TRUE(errors(matrices).empty());
  matrices[2].setZero();
  EXPECT_TRUE(errors(matrices).empty());
}

}  // namespace
}  // namespace shaker::estimator
