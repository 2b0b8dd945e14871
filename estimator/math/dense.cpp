#include "estimator/math/dense.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "estimator/math/dense_product.hpp"

namespace shaker::estimator {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Spectrum spectrum_of(const MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(symmetric);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

ComplexSpectrum complex_spectrum_of(const MatrixXd& square) {
  const Eigen::EigenSolver<MatrixXd> eigen(square);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Eigen::VectorXcd eigenvalues_of(const MatrixXd& square) {
  return Eigen::EigenSolver<MatrixXd>(square, false).eigenvalues();
}

namespace {

SingularValues singular_values(const MatrixXd& a, unsigned what) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, what);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

}  // namespace

SingularValues singular_values_of(const MatrixXd& a) {
  return singular_values(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
}

SingularValues singular_values_with_full_v(const MatrixXd& a) {
  return singular_values(a, Eigen::ComputeThinU | Eigen::ComputeFullV);
}

// --- Cholesky

Cholesky::Cholesky(const MatrixXd& a) : factor_(a) {}
bool Cholesky::positive() const {
  return factor_.info() == Eigen::Success;
}
MatrixXd Cholesky::root() const {
  return factor_.matrixL();
}
VectorXd Cholesky::solve(const VectorXd& b) const {
  return factor_.solve(b);
}
MatrixXd Cholesky::solve(const MatrixXd& b) const {
  return factor_.solve(b);
}
VectorXd Cholesky::whiten(const VectorXd& b) const {
  return factor_.matrixL().solve(b);
}
MatrixXd Cholesky::whiten(const MatrixXd& b) const {
  return lower_quotient(factor_.matrixLLT(), b);
}

Ldlt::Ldlt(const MatrixXd& a) : factor_(a) {}
VectorXd Ldlt::solve(const VectorXd& b) const {
  return factor_.solve(b);
}
MatrixXd Ldlt::solve(const MatrixXd& b) const {
  return factor_.solve(b);
}

// --- elimination

VectorXd solve_square(const MatrixXd& a, const VectorXd& b) {
  return a.partialPivLu().solve(b);
}
MatrixXd solve_square(const MatrixXd& a, const MatrixXd& b) {
  return a.partialPivLu().solve(b);
}
MatrixXd inverse_of(const MatrixXd& a) {
  return a.inverse();
}

// --- least squares

VectorXd least_squares(const MatrixXd& a, const VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

}  // namespace shaker::estimator
