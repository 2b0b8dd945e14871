#include "estimator/math/dense_product.hpp"

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

}  // namespace
}  // namespace shaker::estimator
