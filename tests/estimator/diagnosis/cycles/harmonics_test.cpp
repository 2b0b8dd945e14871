#include "estimator/diagnosis/cycles/harmonics.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

double sum_at(const Eigen::VectorXd& harmonics, double turns) {
  double sum = harmonics[0];
  for (int h = 1; 2 * h < harmonics.size(); ++h) {
    const double angle = 2.0 * std::numbers::pi * h * turns;
    sum += harmonics[2 * h - 1] * std::cos(angle) + harmonics[2 * h] * std::sin(angle);
  }
  return sum;
}

TEST(Harmonics, BecomeTheCurveThatTheyAreOf) {
  for (const int harmonics : {0, 1, 16}) {
    Eigen::VectorXd some(2 * harmonics + 1);
    for (int c = 0; c < some.size(); ++c)
      some[c] = std::cos(1.3 * c * c + 0.4);
    for (const int points : {33, 192}) {
      const Eigen::VectorXd curve = synthesised(some, points);
      const Eigen::VectorXd by_matrix = synthesis_matrix(harmonics, points) * some;
      ASSERT_EQ(curve.size(), points);
      for (int i = 0; i < points; ++i) {
        EXPECT_NEAR(curve[i], sum_at(some, static_cast<double>(i) / points), 1e-12);
        EXPECT_NEAR(by_matrix[i], curve[i], 1e-12);
      }
      EXPECT_LT((analysis_matrix(harmonics, points) * curve - some).norm(), 1e-12);
    }
  }
}

TEST(Harmonics, ShareOneMatrixForAsManyHarmonicsAndPoints) {
  AnalysisMatrices matrices;
  const auto first = matrices.get(3, 48);
  EXPECT_EQ(first->matrix(), analysis_matrix(3, 48));
  EXPECT_EQ(matrices.get(3, 48), first);
  EXPECT_EQ(matrices.get(3, 96)->matrix(), analysis_matrix(3, 96));
  EXPECT_EQ(matrices.get(4, 48)->matrix(), analysis_matrix(4, 48));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
