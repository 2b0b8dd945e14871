#include "estimator/fit/records/internal/square_root_information.hpp"

#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

constexpr Eigen::Index kBlock = 96;  // rows between two factorisations

}  // namespace

SquareRootInformation::SquareRootInformation(Eigen::Index columns)
    : columns_(columns), stack_(columns + 1 + kBlock, columns + 1) {
  clear();
}

void SquareRootInformation::clear() {
  used_ = columns_ + 1;
  stack_.topRows(used_).setZero();
}

Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> SquareRootInformation::row() {
  if (used_ == stack_.rows()) compress();
  stack_.row(used_).setZero();
  return stack_.row(used_++);
}

void SquareRootInformation::compress() {
  triangularise(stack_.topRows(used_));
  used_ = columns_ + 1;
  for (Eigen::Index j = 0; j < used_; ++j)
    stack_.col(j).segment(j + 1, used_ - j - 1).setZero();
}

void SquareRootInformation::finish() {
  compress();
}
Eigen::MatrixXd SquareRootInformation::r() const {
  return stack_.topLeftCorner(columns_, columns_);
}
Eigen::VectorXd SquareRootInformation::right() const {
  return stack_.col(columns_).head(columns_);
}

}  // namespace shaker::estimator
