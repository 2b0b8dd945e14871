// Linear least squares that grows row by row without forming normal equations: the upper triangle R
// with R^T R = J^T J, and Q^T r. The condition of J is not squared, so that what the data do not
// determine can be told from rounding; memory does not grow with the rows.
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator {

class SquareRootInformation {
 public:
  explicit SquareRootInformation(Eigen::Index columns);

  void clear();
  // A row of zeros to be filled in; its last entry is the right-hand side. Valid until the next
  // call.
  Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> row();

  // After the last row. R is columns x columns, right its right-hand side.
  void finish();
  Eigen::MatrixXd r() const;
  Eigen::VectorXd right() const;

 private:
  void compress();

  Eigen::Index columns_, used_ = 0;
  Eigen::MatrixXd stack_;
};

}  // namespace shaker::estimator
