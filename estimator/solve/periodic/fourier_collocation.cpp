// Steps and solutions with the dense matrices of Fourier collocation.
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/LU>

#include "estimator/solve/periodic/internal/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowsOfEquations = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Differentiation matrices of the trigonometric interpolant on n equal steps of [0, 1).
void fourier_matrices(int n, Map<MatrixXd> first, Map<MatrixXd> second) {
  first.setZero();
  second.setZero();
  const double pi = std::numbers::pi;
  const bool even = n % 2 == 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int k = i - j;
      if (k == 0) {
        second(i, j) = even ? -(pi * pi) * (n * n + 2.0) / 3.0 : -(pi * pi) * (n * n - 1.0) / 3.0;
        continue;
      }
      const double sign = k % 2 == 0 ? 1.0 : -1.0;
      const double angle = pi * k / n;
      if (even) {
        first(i, j) = pi * sign / std::tan(angle);
        second(i, j) = -2.0 * pi * pi * sign / (std::sin(angle) * std::sin(angle));
      } else {
        first(i, j) = pi * sign / std::sin(angle);
        second(i, j) =
            -2.0 * pi * pi * sign * std::cos(angle) / (std::sin(angle) * std::sin(angle));
      }
    }
  }
}

Map<const MatrixXd> matrix_of(const std::vector<double>& values, int n) {
  return {values.data(), n, n};
}

}  // namespace

struct PeriodicSystem::Dense::Equations {
  MatrixXd jacobian, right;
  Eigen::PartialPivLU<MatrixXd> lu;
};

PeriodicSystem::Dense::Dense(int n, int unknowns, int columns)
    : first(static_cast<std::size_t>(n) * static_cast<std::size_t>(n)),
      second(first.size()),
      equations(std::make_unique<Equations>()) {
  fourier_matrices(n, {first.data(), n, n}, {second.data(), n, n});
  equations->jacobian.resize(unknowns, unknowns);
  equations->right.resize(unknowns, columns);
}

PeriodicSystem::Dense::~Dense() = default;

void PeriodicSystem::differentiate_fourier() {
  for (int c = 0; c < s_; ++c) {
    for (int i = 0; i < n_; ++i)
      u_[c][i] = z_[i * s_ + c];
    const Map<const VectorXd> u(u_[c], n_);
    Map<VectorXd>(v_[c], n_).noalias() = frequency_ * (matrix_of(dense_->first, n_) * u);
    Map<VectorXd>(a_[c], n_).noalias() =
        frequency_ * frequency_ * (matrix_of(dense_->second, n_) * u);
  }
}

void PeriodicSystem::fill_dense() {
  MatrixXd& j = dense_->equations->jacobian;
  const auto first = matrix_of(dense_->first, n_), second = matrix_of(dense_->second, n_);
  for (int d = 0; d < s_; ++d) {
    for (int e = 0; e < s_; ++e) {
      const int de = d * s_ + e;
      for (int i = 0; i < n_; ++i) {
        for (int k = 0; k < n_; ++k)
          j(i * s_ + d, k * s_ + e) = g_a_[de][i] * frequency_ * frequency_ * second(i, k) +
                                      g_v_[de][i] * frequency_ * first(i, k) +
                                      (i == k ? g_u_[de][i] : 0.0);
      }
    }
  }
}

bool PeriodicSystem::solve_dense() {
  fill_dense();
  fill_right_hand_sides();
  Dense::Equations& e = *dense_->equations;
  Map<RowsOfEquations, 0, Eigen::OuterStride<>> rows(rows_.data(), n_ * s_, 1 + p_,
                                                     Eigen::OuterStride<>(stride_));
  dense_->factorise();
  e.right = rows;
  e.right = e.lu.solve(e.right).eval();
  rows = e.right;
  return e.right.allFinite();
}

void PeriodicSystem::Dense::factorise() {
  equations->lu.compute(equations->jacobian);
}

void PeriodicSystem::Dense::solve(std::span<double> rows, int width) {
  Map<RowsOfEquations> map(rows.data(), equations->jacobian.rows(), width);
  const MatrixXd right = map;
  map = equations->lu.solve(right).eval();
}

void PeriodicSystem::Dense::solve_transposed(std::span<double> rows, int width) {
  Map<RowsOfEquations> map(rows.data(), equations->jacobian.rows(), width);
  const MatrixXd right = map;
  map = equations->lu.transpose().solve(right).eval();
}

}  // namespace shaker::estimator
