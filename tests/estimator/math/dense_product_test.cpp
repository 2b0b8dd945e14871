#include "estimator/math/dense_product.hpp"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

using Eigen::MatrixXd;

// Sizes at which tiles and groups of columns are whole, and at which a part is left over.
TEST(DenseProduct, IsThatOfItsElements) {
  for (const int rows : {1, 11, 12, 13, 40}) {
    for (const int depth : {1, 7, 30}) {
      for (const int columns : {1, 3, 4, 5, 17}) {
        const MatrixXd a = MatrixXd::Random(rows, depth), b = MatrixXd::Random(depth, columns);
        const MatrixXd own = product_with_own(a), c = product(a, b);
        EXPECT_EQ(LeftFactor(a).times(b), c);
        ASSERT_EQ(c.rows(), rows);
        ASSERT_EQ(c.cols(), columns);
        for (int i = 0; i < rows; ++i) {
          for (int j = 0; j < columns; ++j)
            EXPECT_NEAR(c(i, j), a.row(i).dot(b.col(j)), 1e-13);
          for (int j = 0; j < rows; ++j)
            EXPECT_NEAR(own(i, j), a.row(i).dot(a.row(j)), 1e-13);
        }
      }
    }
  }
}

TEST(DenseProduct, OfNothingIsZero) {
  EXPECT_EQ(product(MatrixXd(3, 0), MatrixXd(0, 2)), MatrixXd::Zero(3, 2));
  EXPECT_EQ(product(MatrixXd(0, 4), MatrixXd(4, 2)).size(), 0);
}

// With blocks that are whole, and with a part left over. What lies above the triangle is not read.
TEST(DenseProduct, LowerQuotientTimesTheTriangleIsTheDividend) {
  for (const int n : {0, 1, 31, 32, 33, 70}) {
    const MatrixXd l = MatrixXd::Random(n, n) + 4.0 * MatrixXd::Identity(n, n);
    const MatrixXd b = MatrixXd::Random(n, 5);
    const MatrixXd lower = l.triangularView<Eigen::Lower>();
    EXPECT_TRUE((lower * lower_quotient(l, b)).isApprox(b, 1e-11)) << n;
  }
}

TEST(DenseProduct, ReflectedIsTheTransposeOfTheTridiagonalisationsRotation) {
  for (const int n : {1, 2, 3, 20, 45}) {
    const MatrixXd half = MatrixXd::Random(n, n), symmetric = half + half.transpose();
    const Eigen::Tridiagonalization<MatrixXd> of(symmetric);
    const MatrixXd q = of.matrixQ(), b = MatrixXd::Random(n, 17);
    const MatrixXd turned = reflected(of.packedMatrix(), of.householderCoefficients(), b);
    EXPECT_LT((turned - q.transpose() * b).norm(), 1e-12 * b.norm()) << n;
  }
}

}  // namespace
}  // namespace shaker::estimator
