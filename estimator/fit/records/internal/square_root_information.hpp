// Linear least squares row by row without normal equations. It keeps the upper triangle R with
// R^T R = J^T J, and Q^T r. The condition of J is not squared, so undetermined directions can be
// distinguished from rounding. The memory does not grow with the rows.
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator {

class SquareRootInformation {
 public:
  explicit SquareRootInformation(Eigen::Index columns);

  void clear();
  // Returns a new row of zeros (columns + 1) to be filled in; its last entry is the right-hand
  // side. The reference is valid until the next call.
  Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> row();

  // Call finish() after the last row. R is columns x columns; right() has `columns` values.
  void finish();
  Eigen::MatrixXd r() const;
  Eigen::VectorXd right() const;

 private:
  void compress();

  Eigen::Index columns_, used_ = 0;
  Eigen::MatrixXd stack_;
};

}  // namespace shaker::estimator
