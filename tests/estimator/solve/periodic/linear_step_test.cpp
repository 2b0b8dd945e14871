// One factorisation of a linearised solution is solved for right-hand sides and, transposed,
// for weights of the observations.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

// Columns of sines that no structure of the matrix favours; one column for each right-hand
// side.
std::vector<double> columns(int rows, int width, double step) {
  std::vector<double> all(static_cast<std::size_t>(rows * width));
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = std::sin(step * static_cast<double>(i) + 0.3);
  return all;
}

double product(const std::vector<double>& a, int column, const std::vector<double>& b, int other,
               int width) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); i += static_cast<std::size_t>(width))
    sum += a[i + static_cast<std::size_t>(column)] * b[i + static_cast<std::size_t>(other)];
  return sum;
}

void solve(PeriodicSystem& system, const std::vector<double>& theta) {
  system.set_excitation(2.0, 3.0);
  ASSERT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
  ASSERT_TRUE(system.linearise(theta));
}

// The sensitivities of one coordinate, by the cyclic elimination and by the banded one.
TEST(LinearStep, SolvesForTheSensitivitiesThatTheStepHas) {
  const Model model(testing::oleo());
  PeriodicSystem system(model, {Scheme::order6, 96, false});
  ASSERT_NO_FATAL_FAILURE(solve(system, testing::kOleoSi));
  ASSERT_TRUE(system.solve_step());
  const int p = model.parameter_count();
  std::vector<double> rows;
  for (int i = 0; i < system.points(); ++i) {
    for (int k = 0; k < p; ++k)
      rows.push_back(-system.g_theta(i, 0, k));
  }
  std::vector<double> expected;
  for (int i = 0; i < system.points(); ++i)
    expected.insert(expected.end(), system.row(i, 0).begin() + 1, system.row(i, 0).begin() + 1 + p);
  ASSERT_TRUE(system.factorise());
  system.solve_factorised(rows, p);
  for (std::size_t i = 0; i < rows.size(); ++i)
    EXPECT_NEAR(rows[i], expected[i], 1e-10 * (1.0 + std::fabs(expected[i])));
}

// w'(A^-1 b) = (A^-T w)'b, which is true for the transposed matrix only.
void expect_transposed(const config::ModelSpec& spec, const std::vector<double>& theta,
                       GridOptions grid) {
  const Model model(spec);
  PeriodicSystem system(model, grid);
  ASSERT_NO_FATAL_FAILURE(solve(system, theta));
  ASSERT_TRUE(system.factorise());
  const int width = 11, rows = grid.points * model.coordinates();
  const std::vector<double> b = columns(rows, width, 0.7), w = columns(rows, width, 1.9);
  std::vector<double> solved = b, weights = w;
  system.solve_factorised(solved, width);
  system.solve_transposed(weights, width);
  for (int i = 0; i < width; ++i) {
    for (int k = 0; k < width; ++k) {
      const double direct = product(w, i, solved, k, width);
      double size = 0.0;  // of its terms, because they cancel
      for (std::size_t r = 0; r < solved.size(); r += static_cast<std::size_t>(width))
        size +=
            std::fabs(w[r + static_cast<std::size_t>(i)] * solved[r + static_cast<std::size_t>(k)]);
      EXPECT_NEAR(product(weights, i, b, k, width), direct, 1e-9 * size);
    }
  }
}

TEST(LinearStep, SolvesTheTransposedSystemOfOneCoordinate) {
  expect_transposed(testing::oleo(), testing::kOleoSi, {Scheme::order4, 96, true});
  expect_transposed(testing::oleo(), testing::kOleoSi, {Scheme::order6, 96, true});
}

TEST(LinearStep, SolvesTheTransposedSystemOfADamperWithMemory) {
  config::ModelSpec spec = testing::oleo();
  spec.effects.push_back(testing::effect("presliding_friction"));
  const Model model(spec);
  std::vector<double> theta = model.start();
  std::copy(testing::kOleoSi.begin(), testing::kOleoSi.end(), theta.begin());
  theta[testing::kOleoSi.size()] = 0.3;
  expect_transposed(spec, theta, {Scheme::order6, 128, true});
}

TEST(LinearStep, SolvesTheTransposedSystemOfADenseMatrix) {
  expect_transposed(testing::oleo(), testing::kOleoSi, {Scheme::fourier, 64, false});
}

}  // namespace
}  // namespace shaker::estimator
