#include "estimator/solve/periodic/internal/lane_step.hpp"

#include <cstddef>

namespace shaker::estimator {
namespace {

constexpr double kSmallestLanePivot =
    1e-5;  // relative to the diagonal entry before elimination (border: to the row's largest)

// Computes the coefficients of the equation of point i, before elimination.
template <int Reach>
SHAKER_INLINE void coefficients(const LaneStep& step, int i, Lanes (&c)[2 * Reach + 1]) {
  const Lanes first = step.g_v[i] * step.rate;
  const Lanes second = step.g_a[i] * step.rate * step.rate;
  for (int k = 0; k <= 2 * Reach; ++k)
    c[k] = second * step.stencil.second[static_cast<std::size_t>(k)] +
           first * step.stencil.first[static_cast<std::size_t>(k)];
  c[Reach] += step.g_u[i];
}

// Number of right-hand sides: the template parameter, or step.width if that is 0.
template <int Width>
SHAKER_INLINE int width_of(const LaneStep& step) {
  return Width > 0 ? Width : step.width;
}

// The rows above that the elimination still needs, in registers. u[k - 1][j - 1] is entry j to the
// right of the diagonal in the row k above, or zero if there is no such row.
template <int Reach>
struct RowsAbove {
  Lanes u[Reach][Reach] = {};
};

// Eliminates the rows above from the coefficients of a row; the multipliers go to `multiplier`. The
// entries to the right of the diagonal are divided by the pivot. The result is false in lanes whose
// pivot is too small.
template <int Reach>
SHAKER_INLINE LaneMask eliminate_coefficients(Lanes (&c)[2 * Reach + 1], RowsAbove<Reach>& above,
                                              Lanes* upper, Lanes (&multiplier)[Reach],
                                              Lanes& inverse) {
  Lanes largest{};
  keep_largest(largest, c[Reach]);
  for (int k = Reach; k >= 1; --k) {
    multiplier[k - 1] = c[Reach - k];
    for (int j = 1; j <= Reach; ++j)
      c[Reach - k + j] -= multiplier[k - 1] * above.u[k - 1][j - 1];
  }
  Lanes pivot{};
  keep_largest(pivot, c[Reach]);
  inverse = 1.0 / c[Reach];
  for (int k = Reach - 1; k >= 1; --k) {
    for (int j = 0; j < Reach; ++j)
      above.u[k][j] = above.u[k - 1][j];
  }
  for (int j = 1; j <= Reach; ++j)
    upper[j - 1] = above.u[0][j - 1] = c[Reach + j] * inverse;
  return pivot > kSmallestLanePivot * largest;
}

// Eliminates the `rows` rows above from one right-hand side.
template <int Reach>
SHAKER_INLINE void eliminate_value(int rows, int columns, const Lanes (&multiplier)[Reach],
                                   const Lanes& inverse, Lanes value, Lanes* at) {
  for (int k = rows; k >= 1; --k)
    value -= multiplier[k - 1] * at[-k * columns];
  *at = value * inverse;
}

// Eliminates a row at either end, where some neighbours belong to the border.
template <int Reach>
SHAKER_INLINE LaneMask eliminate_at_end(const LaneStep& step, int i, int columns,
                                        RowsAbove<Reach>& above) {
  const int inner = step.n - Reach;
  Lanes c[2 * Reach + 1];
  coefficients<Reach>(step, i, c);
  Lanes border[Reach] = {};
  for (int k = 0; i + k < Reach; ++k) {
    border[i + k] = c[k];
    c[k] = Lanes{};
  }
  for (int k = inner - i + Reach; k <= 2 * Reach; ++k)
    border[i + k - Reach - inner] = c[k];
  Lanes multiplier[Reach];
  Lanes inverse;
  const LaneMask sound = eliminate_coefficients<Reach>(
      c, above, step.upper + static_cast<std::size_t>(i) * Reach, multiplier, inverse);
  Lanes* row = step.rows + static_cast<std::size_t>(i) * columns;
  const int rows = i < Reach ? i : Reach;
  for (int w = 0; w < columns; ++w) {
    const Lanes value = w < step.width ? -as_lanes(step.left[w])[i] : border[w - step.width];
    eliminate_value<Reach>(rows, columns, multiplier, inverse, value, row + w);
  }
  return sound;
}

template <int Reach, int Width>
SHAKER_INLINE LaneMask eliminate(const LaneStep& step, int columns) {
  const int inner = step.n - Reach;
  const int width = width_of<Width>(step);
  LaneMask sound = ~LaneMask{};
  RowsAbove<Reach> above;
  for (int i = 0; i < Reach; ++i)
    sound &= eliminate_at_end<Reach>(step, i, columns, above);
  for (int i = Reach; i < inner - Reach; ++i) {
    Lanes c[2 * Reach + 1];
    coefficients<Reach>(step, i, c);
    Lanes multiplier[Reach];
    Lanes inverse;
    sound &= eliminate_coefficients<Reach>(
        c, above, step.upper + static_cast<std::size_t>(i) * Reach, multiplier, inverse);
    Lanes* row = step.rows + static_cast<std::size_t>(i) * columns;
    for (int w = 0; w < width; ++w)
      eliminate_value<Reach>(Reach, columns, multiplier, inverse, -as_lanes(step.left[w])[i],
                             row + w);
    for (int w = width; w < width + Reach; ++w)
      eliminate_value<Reach>(Reach, columns, multiplier, inverse, Lanes{}, row + w);
  }
  for (int i = inner - Reach; i < inner; ++i)
    sound &= eliminate_at_end<Reach>(step, i, columns, above);
  return sound;
}

template <int Reach, int Width>
SHAKER_INLINE void substitute(const LaneStep& step, int columns) {
  const int inner = step.n - Reach;
  for (int i = inner - 2; i >= 0; --i) {
    const Lanes* u = step.upper + static_cast<std::size_t>(i) * Reach;
    Lanes* row = step.rows + static_cast<std::size_t>(i) * columns;
    const int last = inner - 1 - i < Reach ? inner - 1 - i : Reach;
    if (last == Reach) {
      Lanes factor[Reach];
      for (int j = 0; j < Reach; ++j)
        factor[j] = u[j];
      for (int w = 0; w < width_of<Width>(step) + Reach; ++w) {
        Lanes value = row[w];
        for (int j = Reach; j >= 1; --j)
          value -= factor[j - 1] * row[w + j * columns];
        row[w] = value;
      }
      continue;
    }
    for (int w = 0; w < columns; ++w) {
      for (int j = last; j >= 1; --j)
        row[w] -= u[j - 1] * row[w + j * columns];
    }
  }
}

// Substitutes the inner unknowns into the last Reach equations and solves these in place, without
// row exchanges.
template <int Reach>
SHAKER_INLINE LaneMask solve_border(const LaneStep& step, int columns) {
  const int inner = step.n - Reach;
  Lanes s[Reach][Reach] = {};
  for (int b = 0; b < Reach; ++b) {
    Lanes c[2 * Reach + 1];
    coefficients<Reach>(step, inner + b, c);
    Lanes* row = step.rows + static_cast<std::size_t>(inner + b) * columns;
    for (int w = 0; w < step.width; ++w)
      row[w] = -as_lanes(step.left[w])[inner + b];
    for (int k = 0; k <= 2 * Reach; ++k) {
      int j = inner + b + k - Reach;
      if (j >= step.n) j -= step.n;
      if (j >= inner) {
        s[b][j - inner] += c[k];
        continue;
      }
      const Lanes* other = step.rows + static_cast<std::size_t>(j) * columns;
      for (int e = 0; e < Reach; ++e)
        s[b][e] -= c[k] * other[step.width + e];
      for (int w = 0; w < step.width; ++w)
        row[w] -= c[k] * other[w];
    }
  }
  LaneMask sound = ~LaneMask{};
  const auto row = [&](int b) { return step.rows + static_cast<std::size_t>(inner + b) * columns; };
  for (int k = 0; k < Reach; ++k) {
    Lanes largest{};
    for (int e = 0; e < Reach; ++e)
      keep_largest(largest, s[k][e]);
    Lanes pivot{};
    keep_largest(pivot, s[k][k]);
    sound &= pivot > kSmallestLanePivot * largest;
    const Lanes inverse = 1.0 / s[k][k];
    for (int e = k + 1; e < Reach; ++e)
      s[k][e] *= inverse;
    for (int w = 0; w < step.width; ++w)
      row(k)[w] *= inverse;
    for (int r = k + 1; r < Reach; ++r) {
      for (int e = k + 1; e < Reach; ++e)
        s[r][e] -= s[r][k] * s[k][e];
      for (int w = 0; w < step.width; ++w)
        row(r)[w] -= s[r][k] * row(k)[w];
    }
  }
  for (int k = Reach - 2; k >= 0; --k) {
    for (int e = k + 1; e < Reach; ++e) {
      for (int w = 0; w < step.width; ++w)
        row(k)[w] -= s[k][e] * row(e)[w];
    }
  }
  return sound;
}

template <int Reach, int Width>
SHAKER_INLINE unsigned solve(const LaneStep& step) {
  const int width = width_of<Width>(step);
  const int columns = width + Reach;
  const int inner = step.n - Reach;
  LaneMask sound = eliminate<Reach, Width>(step, columns);
  substitute<Reach, Width>(step, columns);
  sound &= solve_border<Reach>(step, columns);
  const Lanes* border = step.rows + static_cast<std::size_t>(inner) * columns;
  for (int i = 0; i < inner; ++i) {
    Lanes* row = step.rows + static_cast<std::size_t>(i) * columns;
    Lanes share[Reach];
    for (int b = 0; b < Reach; ++b)
      share[b] = row[width + b];
    for (int w = 0; w < width; ++w) {
      Lanes value = row[w];
      for (int b = 0; b < Reach; ++b)
        value -= share[b] * border[b * columns + w];
      row[w] = value;
    }
  }
  return bits_of(sound);
}

// Widths known at compile time: 1 (no sensitivities), 5 (the oleo); 0: any width.
#define SHAKER_LANE_STEP(REACH, WIDTH)                                        \
  SHAKER_SIMD_CLONES unsigned solve_##REACH##_##WIDTH(const LaneStep& step) { \
    return solve<REACH, WIDTH>(step);                                         \
  }
SHAKER_LANE_STEP(1, 0)
SHAKER_LANE_STEP(1, 1)
SHAKER_LANE_STEP(1, 5)
SHAKER_LANE_STEP(2, 0)
SHAKER_LANE_STEP(2, 1)
SHAKER_LANE_STEP(2, 5)
SHAKER_LANE_STEP(3, 0)
SHAKER_LANE_STEP(3, 1)
SHAKER_LANE_STEP(3, 5)
#undef SHAKER_LANE_STEP

using LaneSolve = unsigned (*)(const LaneStep&);
constexpr LaneSolve kLaneSolve[3][3] = {{solve_1_0, solve_1_1, solve_1_5},
                                        {solve_2_0, solve_2_1, solve_2_5},
                                        {solve_3_0, solve_3_1, solve_3_5}};

}  // namespace

unsigned solve_lane_step(const LaneStep& step) {
  const int kind = step.width == 1 ? 1 : step.width == kOleoWidth ? 2 : 0;
  return kLaneSolve[step.stencil.reach - 1][kind](step);
}

}  // namespace shaker::estimator
