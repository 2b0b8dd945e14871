#include "estimator/periodic/scalar_step.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {
namespace {

// A pivot smaller than this against the largest entry of its row loses too many digits.
constexpr double kSmallestPivot = 1e-5;

// Gaussian elimination with row exchanges for the border's few unknowns: S x = b for whole rows b.
template <int Reach, int Groups>
SHAKER_INLINE bool solve_border(double (&s)[Reach][Reach], Lanes (&b)[Reach][Groups]) {
  for (int k = 0; k < Reach; ++k) {
    int best = k;
    for (int r = k + 1; r < Reach; ++r) {
      if (std::fabs(s[r][k]) > std::fabs(s[best][k])) best = r;
    }
    if (!(std::fabs(s[best][k]) > 0.0)) return false;
    if (best != k) {
      for (int c = 0; c < Reach; ++c)
        std::swap(s[k][c], s[best][c]);
      for (int w = 0; w < Groups; ++w)
        std::swap(b[k][w], b[best][w]);
    }
    for (int r = k + 1; r < Reach; ++r) {
      const double m = s[r][k] / s[k][k];
      for (int c = k + 1; c < Reach; ++c)
        s[r][c] -= m * s[k][c];
      for (int w = 0; w < Groups; ++w)
        b[r][w] -= m * b[k][w];
    }
  }
  for (int k = Reach - 1; k >= 0; --k) {
    for (int c = k + 1; c < Reach; ++c) {
      for (int w = 0; w < Groups; ++w)
        b[k][w] -= s[k][c] * b[c][w];
    }
    const double inverse = 1.0 / s[k][k];
    for (int w = 0; w < Groups; ++w)
      b[k][w] *= inverse;
  }
  return true;
}

template <int Reach, int Groups>
SHAKER_INLINE bool solve(const ScalarStep& step) {
  const int inner = step.n - Reach;  // unknowns that are not the border
  const int width = step.width;
  Lanes* rows = reinterpret_cast<Lanes*>(step.rows);
  double* upper = step.upper;
  const double* band = step.band;

  // Couplings to the border become extra right-hand sides: lanes width .. width + Reach - 1.
  for (int i = 0; i < Reach; ++i) {
    double* lanes = step.rows + static_cast<std::size_t>(i) * Groups * kLanes;
    for (int k = -Reach; i + k < 0; ++k)
      lanes[width + Reach + i + k] = band[8 * i + Reach + k];
    const int j = inner - Reach + i;
    lanes = step.rows + static_cast<std::size_t>(j) * Groups * kLanes;
    for (int k = inner - j; k <= Reach; ++k)
      lanes[width + j + k - inner] = band[8 * j + Reach + k];
  }

  // The last Reach rows stay in registers: reading them back from memory would wait for the stores.
  bool sound = true;
  double u[Reach][Reach] = {};  // u[k - 1][j - 1]: upper entry j of row i - k
  Lanes r[Reach][Groups] = {};  // r[k - 1]: right-hand sides of row i - k
  for (int i = 0; i < inner; ++i) {
    double c[2 * Reach + 1];
    for (int k = 0; k <= 2 * Reach; ++k)
      c[k] = band[8 * i + k];
    if (i < Reach) {
      for (int k = i + 1; k <= Reach; ++k)
        c[Reach - k] = 0.0;  // went to the border's lanes
    }
    const double largest = std::fabs(c[Reach]);
    Lanes row[Groups];
    for (int w = 0; w < Groups; ++w)
      row[w] = rows[i * Groups + w];
    for (int k = Reach; k >= 1; --k) {
      const double l = c[Reach - k];
      for (int j = 1; j <= Reach; ++j)
        c[Reach - k + j] -= l * u[k - 1][j - 1];
      for (int w = 0; w < Groups; ++w)
        row[w] -= l * r[k - 1][w];
    }
    sound &= std::fabs(c[Reach]) > kSmallestPivot * largest;
    const double inverse = 1.0 / c[Reach];
    for (int k = Reach - 1; k >= 1; --k) {
      for (int j = 0; j < Reach; ++j)
        u[k][j] = u[k - 1][j];
      for (int w = 0; w < Groups; ++w)
        r[k][w] = r[k - 1][w];
    }
    for (int j = 1; j <= Reach; ++j)
      upper[4 * i + j] = u[0][j - 1] = c[Reach + j] * inverse;
    for (int w = 0; w < Groups; ++w)
      rows[i * Groups + w] = r[0][w] = row[w] * inverse;
  }
  if (!sound) return false;
  for (int k = 0; k < Reach; ++k) {
    for (int w = 0; w < Groups; ++w)
      r[k][w] = Lanes{};
  }
  for (int i = inner - 1; i >= 0; --i) {
    Lanes row[Groups];
    for (int w = 0; w < Groups; ++w)
      row[w] = rows[i * Groups + w];
    for (int j = Reach; j >= 1; --j) {
      for (int w = 0; w < Groups; ++w)
        row[w] -= upper[4 * i + j] * r[j - 1][w];
    }
    for (int k = Reach - 1; k >= 1; --k) {
      for (int w = 0; w < Groups; ++w)
        r[k][w] = r[k - 1][w];
    }
    for (int w = 0; w < Groups; ++w)
      rows[i * Groups + w] = r[0][w] = row[w];
  }

  // Schur complement of the border.
  double schur[Reach][Reach] = {};
  Lanes border[Reach][Groups];
  for (int b = 0; b < Reach; ++b) {
    const int i = inner + b;
    for (int w = 0; w < Groups; ++w)
      border[b][w] = rows[i * Groups + w];
    for (int k = -Reach; k <= Reach; ++k) {
      const double value = band[8 * i + Reach + k];
      int j = i + k;
      if (j >= step.n) j -= step.n;
      if (j >= inner) {
        schur[b][j - inner] += value;
        continue;
      }
      const double* lanes = step.rows + static_cast<std::size_t>(j) * Groups * kLanes;
      for (int c = 0; c < Reach; ++c)
        schur[b][c] -= value * lanes[width + c];
      for (int w = 0; w < Groups; ++w)
        border[b][w] -= value * rows[j * Groups + w];
    }
  }
  if (!solve_border<Reach, Groups>(schur, border)) return false;
  for (int i = 0; i < inner; ++i) {
    const double* lanes = step.rows + static_cast<std::size_t>(i) * Groups * kLanes;
    double y[Reach];
    for (int b = 0; b < Reach; ++b)
      y[b] = lanes[width + b];
    for (int b = 0; b < Reach; ++b) {
      for (int w = 0; w < Groups; ++w)
        rows[i * Groups + w] -= y[b] * border[b][w];
    }
  }
  for (int b = 0; b < Reach; ++b) {
    for (int w = 0; w < Groups; ++w)
      rows[(inner + b) * Groups + w] = border[b][w];
  }
  return true;
}

template <int Groups>
SHAKER_INLINE void sum_products(const GramSum& sum) {
  const int size = 1 + sum.parameters;
  Lanes total[kLanes * Groups][Groups];
  for (int k = 0; k < size; ++k) {
    for (int w = 0; w < Groups; ++w)
      total[k][w] = Lanes{};
  }
  for (int j = 0; j < sum.count; ++j) {
    const std::size_t point = static_cast<std::size_t>(j) * sum.every;
    const double* lanes = sum.rows + point * Groups * kLanes;
    const Lanes* row = reinterpret_cast<const Lanes*>(lanes);
    const double residual = sum.data[j] - sum.state[point] - (sum.with_newton ? lanes[0] : 0.0);
    Lanes own[Groups];
    for (int w = 0; w < Groups; ++w)
      own[w] = row[w];
    own[0][0] = residual;
    for (int w = 0; w < Groups; ++w)
      total[0][w] += residual * own[w];
    for (int k = 1; k < size; ++k) {
      for (int w = 0; w < Groups; ++w)
        total[k][w] += lanes[k] * own[w];
    }
  }
  for (int k = 0; k < size; ++k) {
    for (int l = 0; l < size; ++l)
      sum.products[k * size + l] += sum.weight * total[k][l / kLanes][l % kLanes];
  }
}

#define SHAKER_SCALAR_STEP(REACH, GROUPS)                                 \
  SHAKER_SIMD_CLONES bool solve_##REACH##_##GROUPS(const ScalarStep& s) { \
    return solve<REACH, GROUPS>(s);                                       \
  }
SHAKER_SCALAR_STEP(1, 1)
SHAKER_SCALAR_STEP(1, 2)
SHAKER_SCALAR_STEP(1, 3)
SHAKER_SCALAR_STEP(1, 4)
SHAKER_SCALAR_STEP(2, 1)
SHAKER_SCALAR_STEP(2, 2)
SHAKER_SCALAR_STEP(2, 3)
SHAKER_SCALAR_STEP(2, 4)
SHAKER_SCALAR_STEP(3, 1)
SHAKER_SCALAR_STEP(3, 2)
SHAKER_SCALAR_STEP(3, 3)
SHAKER_SCALAR_STEP(3, 4)
#undef SHAKER_SCALAR_STEP

#define SHAKER_GRAM_SUM(GROUPS)                            \
  SHAKER_SIMD_CLONES void sum_##GROUPS(const GramSum& s) { \
    sum_products<GROUPS>(s);                               \
  }
SHAKER_GRAM_SUM(1)
SHAKER_GRAM_SUM(2)
SHAKER_GRAM_SUM(3)
SHAKER_GRAM_SUM(4)
#undef SHAKER_GRAM_SUM

using Solve = bool (*)(const ScalarStep&);
constexpr Solve kSolve[3][4] = {{solve_1_1, solve_1_2, solve_1_3, solve_1_4},
                                {solve_2_1, solve_2_2, solve_2_3, solve_2_4},
                                {solve_3_1, solve_3_2, solve_3_3, solve_3_4}};

}  // namespace

bool solve_scalar_step(const ScalarStep& step) {
  return kSolve[step.reach - 1][step.groups - 1](step);
}

void add_products(const GramSum& sum) {
  constexpr void (*kSum[4])(const GramSum&) = {sum_1, sum_2, sum_3, sum_4};
  kSum[sum.groups - 1](sum);
}

}  // namespace shaker::estimator
