// Fourier collocation: dense matrices instead of a band. Private to PeriodicSystem's sources. They
// do not see Eigen, whose templates are compiled in fourier_collocation.cpp alone.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct PeriodicSystem::Dense {
  // `n` points on the ring, the unknowns of all of them, and columns of right-hand sides.
  Dense(int n, int unknowns, int columns);
  ~Dense();

  void factorise();  // the Jacobian that fill_dense() has filled
  // As PeriodicSystem::solve_factorised() and solve_transposed().
  void solve(std::span<double> rows, int width);
  void solve_transposed(std::span<double> rows, int width);

  std::vector<double> first, second;  // differentiation matrices, n x n, column by column
  struct Equations;                   // the Jacobian and its factors
  std::unique_ptr<Equations> equations;
};

}  // namespace shaker::estimator
