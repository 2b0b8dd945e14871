#include "estimator/math/cyclic_banded_lu.hpp"

#include <limits>
#include <random>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "estimator/math/aligned.hpp"
#include "estimator/solve/periodic/ring_step.hpp"

namespace shaker::estimator {
namespace {

struct Shape {
  int n, block, reach;
};

class CyclicSystems : public ::testing::TestWithParam<Shape> {};

TEST_P(CyclicSystems, AreSolvedAsByADenseFactorisation) {
  const int n = GetParam().n, block = GetParam().block, reach = GetParam().reach;
  const int size = n * block;
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  CyclicBandedLu lu(n, block, reach);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
  std::vector<double> parts(static_cast<std::size_t>(2 * reach + 1));
  const auto fill = [&] {
    lu.clear();
    dense.setZero();
    for (int i = 0; i < n; ++i)
      for (int r = 0; r < block; ++r)
        for (int c = 0; c < block; ++c) {
          // Some diagonals are small, so that elimination without row exchanges would fail.
          for (int k = -reach; k <= reach; ++k) {
            const double value = k == 0 && i % 3 == 0 ? 1e-12 : normal(random);
            parts[static_cast<std::size_t>(k + reach)] = value;
            dense(i * block + r, (i + k + n) % n * block + c) += value;
          }
          lu.add(i, r, c, parts.data());
        }
  };
  fill();
  ASSERT_TRUE(lu.factorise());
  // A second matrix in the same storage: nothing of the first one remains.
  fill();
  ASSERT_TRUE(lu.factorise());
  // Right-hand sides are solved eight or sixteen at a time.
  for (const int width : {3, 11, 20}) {
    const int stride = width + 2;
    std::vector<double> rows(static_cast<std::size_t>(size) * stride);
    Eigen::MatrixXd right(size, width);
    for (int i = 0; i < size; ++i)
      for (int w = 0; w < width; ++w)
        rows[i * stride + w] = right(i, w) = normal(random);
    lu.solve(rows.data(), stride, width);
    const Eigen::MatrixXd want = dense.partialPivLu().solve(right);
    const double scale = want.cwiseAbs().maxCoeff();
    for (int i = 0; i < size; ++i)
      for (int w = 0; w < width; ++w)
        EXPECT_NEAR(rows[i * stride + w], want(i, w), 1e-9 * scale) << i << " " << w;
    for (int i = 0; i < size; ++i)
      for (int w = 0; w < width; ++w)
        rows[i * stride + w] = right(i, w);
    lu.solve_transposed(rows.data(), stride, width);
    const Eigen::MatrixXd other = dense.transpose().partialPivLu().solve(right);
    for (int i = 0; i < size; ++i)
      for (int w = 0; w < width; ++w)
        EXPECT_NEAR(rows[i * stride + w], other(i, w), 1e-9 * other.cwiseAbs().maxCoeff());
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, CyclicSystems,
                         ::testing::Values(Shape{5, 1, 1}, Shape{8, 1, 2}, Shape{9, 1, 3},
                                           Shape{40, 1, 2}, Shape{41, 2, 2}, Shape{30, 3, 3},
                                           Shape{7, 2, 3}, Shape{25, 4, 3}));

TEST(CyclicSystem, ThatHoldsNoNumberHasNoFactors) {
  CyclicBandedLu lu(16, 2, 3);
  for (const int broken : {0, 5, 15}) {
    lu.clear();
    for (int i = 0; i < 16; ++i)
      for (int r = 0; r < 2; ++r) {
        std::vector<double> parts(7, 0.1);
        parts[3] = i == broken ? std::numeric_limits<double>::quiet_NaN() : 2.0;
        lu.add(i, r, r, parts.data());
      }
    EXPECT_FALSE(lu.factorise()) << broken;
  }
}

struct StepShape {
  int n, reach, width, block = 1;
};
class RingSteps : public ::testing::TestWithParam<StepShape> {};

TEST_P(RingSteps, AreSolvedAsByADenseFactorisation) {
  const auto [n, reach, width, block] = GetParam();
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  RingStep step;
  step.n = n;
  step.reach = reach;
  step.width = width;
  step.block = block;
  step.groups = lane_groups(width, reach, block);
  ASSERT_TRUE(ring_step_exists(block, reach, step.groups));
  const int size = n * block;
  const auto places = static_cast<std::size_t>(size * packed(block));
  AlignedVector band(places * 8), upper(places * 4),
      rows(static_cast<std::size_t>(size) * step.groups * 8);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
  Eigen::MatrixXd right(size, width);
  for (int r = 0; r < size; ++r) {
    for (int k = -reach; k <= reach; ++k) {
      for (int e = 0; e < block; ++e) {
        const double value = normal(random) + (k == 0 && r % block == e ? 6.0 * block : 0.0);
        band[(r * 8 + reach + k) * packed(block) + e] = value;
        dense(r, (r / block + k + n) % n * block + e) += value;
      }
    }
    for (int w = 0; w < width; ++w)
      rows[static_cast<std::size_t>(r) * step.groups * 8 + w] = right(r, w) = normal(random);
  }
  step.band = band.data();
  step.upper = upper.data();
  step.rows = rows.data();
  ASSERT_TRUE(solve_ring_step(step));
  const Eigen::MatrixXd want = dense.partialPivLu().solve(right);
  for (int r = 0; r < size; ++r)
    for (int w = 0; w < width; ++w)
      EXPECT_NEAR(rows[static_cast<std::size_t>(r) * step.groups * 8 + w], want(r, w), 1e-11);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, RingSteps,
    ::testing::Values(StepShape{40, 1, 5}, StepShape{40, 2, 5}, StepShape{40, 3, 5},
                      StepShape{11, 3, 1}, StepShape{12, 3, 5}, StepShape{13, 3, 5},
                      StepShape{14, 3, 5}, StepShape{8, 2, 3}, StepShape{9, 2, 3},
                      StepShape{5, 1, 2}, StepShape{6, 1, 2}, StepShape{64, 2, 12},
                      StepShape{64, 3, 20}, StepShape{33, 1, 29}, StepShape{40, 3, 7, 2},
                      StepShape{11, 3, 1, 2}, StepShape{64, 2, 28, 2}, StepShape{21, 2, 3, 2},
                      StepShape{40, 3, 20, 2}, StepShape{40, 3, 7, 3}, StepShape{12, 3, 20, 3},
                      StepShape{33, 2, 9, 3}, StepShape{40, 3, 12, 4}, StepShape{11, 3, 20, 4},
                      StepShape{30, 2, 24, 4}, StepShape{30, 2, 1, 4}));

TEST(RingStepSolver, GivesUpOnABlockThatNeedsARowExchange) {
  constexpr int n = 20;
  RingStep step;
  step.n = n;
  step.reach = 2;
  step.width = 1;
  step.block = 2;
  step.groups = lane_groups(1, 2, 2);
  AlignedVector band(n * 2 * 16), upper(n * 2 * 8),
      rows(static_cast<std::size_t>(n * 2) * step.groups * 8);
  for (int i = 0; i < n; ++i) {
    for (int d = 0; d < 2; ++d) {
      for (int k = 0; k < 5; ++k)
        band[(i * 2 + d) * 16 + k * 2 + d] = k == 2 ? 6.0 : 1.0;
    }
  }
  band[(7 * 2 + 0) * 16 + 2 * 2 + 0] = 0.0;  // unknown 0 of point 7 depends on nothing of itself,
  band[(7 * 2 + 0) * 16 + 1 * 2 + 0] = 0.0;  // nor on the points before
  band[(7 * 2 + 0) * 16 + 0 * 2 + 0] = 0.0;
  step.band = band.data();
  step.upper = upper.data();
  step.rows = rows.data();
  EXPECT_FALSE(solve_ring_step(step));
}

TEST(RingStepSolver, GivesUpOnAPivotThatNeedsARowExchange) {
  constexpr int n = 20;
  RingStep step;
  step.n = n;
  step.reach = 1;
  step.width = 1;
  step.groups = 1;
  AlignedVector band(n * 8), upper(n * 4), rows(n * 8, 1.0);
  for (int i = 0; i < n; ++i) {
    band[8 * i] = band[8 * i + 2] = 1.0;
    band[8 * i + 1] = i == 0 ? 0.0 : 3.0;
  }
  step.band = band.data();
  step.upper = upper.data();
  step.rows = rows.data();
  EXPECT_FALSE(solve_ring_step(step));
}

}  // namespace
}  // namespace shaker::estimator
