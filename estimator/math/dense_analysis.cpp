// The part of dense.hpp that a service on the rig does not need.
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "estimator/math/dense.hpp"
#include "estimator/math/dense_product.hpp"

namespace shaker::estimator {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// --- Householder

Tridiagonal::Tridiagonal(const MatrixXd& symmetric) {
  const Eigen::Tridiagonalization<MatrixXd> t(symmetric);
  diagonal_ = t.diagonal();
  beside_ = t.subDiagonal();
  factors_ = t.householderCoefficients();
  reflectors_ = t.packedMatrix();
}
MatrixXd Tridiagonal::rotated(const MatrixXd& b) const {
  return reflected(reflectors_, factors_, b);
}

PivotedQr::PivotedQr(const MatrixXd& a) : factor_(a) {}
void PivotedQr::set_threshold(double share) {
  factor_.setThreshold(share);
}
Index PivotedQr::rank() const {
  return factor_.rank();
}
VectorXd PivotedQr::pivots() const {
  return factor_.matrixQR().diagonal();
}
MatrixXd PivotedQr::basis(Index columns) const {
  return factor_.householderQ() * MatrixXd::Identity(factor_.rows(), columns);
}
VectorXd PivotedQr::rotated(const VectorXd& b) const {
  return factor_.householderQ().adjoint() * b;
}
MatrixXd PivotedQr::rotated(const MatrixXd& b) const {
  return factor_.householderQ().adjoint() * b;
}
VectorXd PivotedQr::solve(const VectorXd& b) const {
  return factor_.solve(b);
}
MatrixXd PivotedQr::solve(const MatrixXd& b) const {
  return factor_.solve(b);
}

MatrixXd orthogonal_factor(const MatrixXd& a) {
  return Eigen::HouseholderQR<MatrixXd>(a).householderQ();
}

TallQr::TallQr(const MatrixXd& a) : factor_(a) {}
MatrixXd TallQr::r() const {
  const Index n = factor_.cols();
  return factor_.matrixQR().topRows(n).triangularView<Eigen::Upper>();
}
MatrixXd TallQr::rotated(const MatrixXd& b) const {
  return factor_.householderQ().adjoint() * b;
}

void triangularise(Eigen::Ref<MatrixXd> a) {
  const Eigen::HouseholderQR<Eigen::Ref<MatrixXd>> qr(a);
}

// --- triangles

MatrixXd lower_times(const MatrixXd& l, const MatrixXd& b) {
  if (b.cols() == 1)
    return VectorXd(l.triangularView<Eigen::Lower>() * b.col(0));  // a tenth of the time
  return l.triangularView<Eigen::Lower>() * b;
}
VectorXd lower_transposed_times(const MatrixXd& l, const VectorXd& b) {
  return l.triangularView<Eigen::Lower>().transpose() * b;
}
VectorXd lower_solve(const MatrixXd& l, const VectorXd& b) {
  return l.triangularView<Eigen::Lower>().solve(b);
}
MatrixXd lower_solve(const MatrixXd& l, const MatrixXd& b) {
  return lower_quotient(l, b);
}

void add_gram(MatrixXd& sum, const MatrixXd& rows) {
  sum.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
}
void add_square(MatrixXd& sum, const VectorXd& p, double weight) {
  sum.selfadjointView<Eigen::Lower>().rankUpdate(p, weight);
}
MatrixXd symmetric_of_lower(const MatrixXd& lower) {
  return lower.selfadjointView<Eigen::Lower>();
}

// --- least squares

MatrixXd least_squares(const MatrixXd& a, const MatrixXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

VectorXd least_squares_by_singular_values(const MatrixXd& a, const VectorXd& b) {
  return Eigen::JacobiSVD<MatrixXd>(a, Eigen::ComputeThinU | Eigen::ComputeThinV).solve(b);
}

MatrixXd shortest_least_squares(const MatrixXd& a, const MatrixXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

}  // namespace shaker::estimator
