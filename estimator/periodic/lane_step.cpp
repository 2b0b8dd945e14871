#include "estimator/periodic/lane_step.hpp"

#include <cstddef>

namespace shaker::estimator {
namespace {

constexpr double kSmallestPivot = 1e-5;  // against the largest entry of its row, as in scalar_step

SHAKER_INLINE void keep_largest(Lanes& largest, const Lanes& value) {
  const Lanes size = value < 0.0 ? -value : value;
  largest = size > largest ? size : largest;
}

// Coefficients of the equation of point i: those of the ring, nothing folded yet.
template <int Reach>
SHAKER_INLINE void coefficients(const LaneStep& step, int i, Lanes (&c)[2 * Reach + 1]) {
  const Lanes first = step.g_v[i] * step.rate;
  const Lanes second = step.g_a[i] * step.rate * step.rate;
  for (int k = 0; k <= 2 * Reach; ++k)
    c[k] = second * step.stencil.second[static_cast<std::size_t>(k)] +
           first * step.stencil.first[static_cast<std::size_t>(k)];
  c[Reach] += step.g_u[i];
}

template <int Reach>
SHAKER_INLINE LaneMask eliminate(const LaneStep& step, int columns) {
  const int inner = step.n - Reach;
  LaneMask sound = ~LaneMask{};
  for (int i = 0; i < inner; ++i) {
    Lanes c[2 * Reach + 1];
    coefficients<Reach>(step, i, c);
    Lanes* row = step.rows + static_cast<std::size_t>(i) * columns;
    Lanes border[Reach] = {};
    if (i < Reach) {
      for (int k = 0; i + k < Reach; ++k) {
        border[i + k] = c[k];
        c[k] = Lanes{};
      }
    }
    for (int k = inner - i + Reach; k <= 2 * Reach; ++k)
      border[i + k - Reach - inner] = c[k];
    Lanes largest{};
    keep_largest(largest, c[Reach]);
    Lanes multiplier[Reach];
    for (int k = Reach < i ? Reach : i; k >= 1; --k) {
      const Lanes* u = step.upper + static_cast<std::size_t>(i - k) * Reach;
      multiplier[k - 1] = c[Reach - k];
      for (int j = 1; j <= Reach; ++j)
        c[Reach - k + j] -= multiplier[k - 1] * u[j - 1];
    }
    Lanes pivot{};
    keep_largest(pivot, c[Reach]);
    sound &= pivot > kSmallestPivot * largest;
    const Lanes inverse = 1.0 / c[Reach];
    for (int j = 1; j <= Reach; ++j)
      step.upper[static_cast<std::size_t>(i) * Reach + j - 1] = c[Reach + j] * inverse;
    if (i < Reach) {
      for (int w = 0; w < columns; ++w) {
        Lanes value = w < step.width ? -as_lanes(step.left[w])[i] : border[w - step.width];
        for (int k = i; k >= 1; --k)
          value -= multiplier[k - 1] * row[w - k * columns];
        row[w] = value * inverse;
      }
      continue;
    }
    for (int w = 0; w < step.width; ++w) {
      Lanes value = -as_lanes(step.left[w])[i];
      for (int k = Reach; k >= 1; --k)
        value -= multiplier[k - 1] * row[w - k * columns];
      row[w] = value * inverse;
    }
    for (int b = 0; b < Reach; ++b) {
      const int w = step.width + b;
      Lanes value = border[b];
      for (int k = Reach; k >= 1; --k)
        value -= multiplier[k - 1] * row[w - k * columns];
      row[w] = value * inverse;
    }
  }
  return sound;
}

template <int Reach>
SHAKER_INLINE void substitute(const LaneStep& step, int columns) {
  const int inner = step.n - Reach;
  for (int i = inner - 2; i >= 0; --i) {
    const Lanes* u = step.upper + static_cast<std::size_t>(i) * Reach;
    Lanes* row = step.rows + static_cast<std::size_t>(i) * columns;
    const int last = inner - 1 - i < Reach ? inner - 1 - i : Reach;
    if (last == Reach) {
      for (int w = 0; w < columns; ++w) {
        Lanes value = row[w];
        for (int j = Reach; j >= 1; --j)
          value -= u[j - 1] * row[w + j * columns];
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

// The last Reach equations, with the inner unknowns put in; solved in place, without exchanges.
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
    sound &= pivot > kSmallestPivot * largest;
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

template <int Reach>
SHAKER_INLINE unsigned solve(const LaneStep& step) {
  const int columns = step.width + Reach;
  const int inner = step.n - Reach;
  LaneMask sound = eliminate<Reach>(step, columns);
  substitute<Reach>(step, columns);
  sound &= solve_border<Reach>(step, columns);
  const Lanes* border = step.rows + static_cast<std::size_t>(inner) * columns;
  for (int i = 0; i < inner; ++i) {
    Lanes* row = step.rows + static_cast<std::size_t>(i) * columns;
    for (int w = 0; w < step.width; ++w) {
      Lanes value = row[w];
      for (int b = 0; b < Reach; ++b)
        value -= row[step.width + b] * border[b * columns + w];
      row[w] = value;
    }
  }
  return bits_of(sound);
}

SHAKER_SIMD_CLONES unsigned solve_1(const LaneStep& step) {
  return solve<1>(step);
}
SHAKER_SIMD_CLONES unsigned solve_2(const LaneStep& step) {
  return solve<2>(step);
}
SHAKER_SIMD_CLONES unsigned solve_3(const LaneStep& step) {
  return solve<3>(step);
}

}  // namespace

unsigned solve_lane_step(const LaneStep& step) {
  switch (step.stencil.reach) {
    case 1:
      return solve_1(step);
    case 2:
      return solve_2(step);
    default:
      return solve_3(step);
  }
}

namespace {

template <int Reach>
SHAKER_INLINE void difference(int n, const Stencil& stencil, const Lanes& rate, const Lanes* z,
                              Lanes* v, Lanes* a) {
  const Lanes square = rate * rate;
  for (int i = 0; i < n; ++i) {
    Lanes dv{};
    Lanes da{};
    const bool inside = i >= Reach && i < n - Reach;
    for (int k = 0; k <= 2 * Reach; ++k) {
      int j = i + k - Reach;
      if (!inside) j = j < 0 ? j + n : j >= n ? j - n : j;
      dv += stencil.first[static_cast<std::size_t>(k)] * z[j];
      da += stencil.second[static_cast<std::size_t>(k)] * z[j];
    }
    v[i] = rate * dv;
    a[i] = square * da;
  }
}

}  // namespace

SHAKER_SIMD_CLONES void difference_lanes(int n, const Stencil& stencil, const Lanes& rate,
                                         const Lanes* z, Lanes* v, Lanes* a) {
  if (stencil.reach == 3)
    difference<3>(n, stencil, rate, z, v, a);
  else if (stencil.reach == 2)
    difference<2>(n, stencil, rate, z, v, a);
  else
    difference<1>(n, stencil, rate, z, v, a);
}

SHAKER_SIMD_CLONES void sum_lane_products(const LaneGram& gram) {
  const int size = gram.width * (gram.width + 1) / 2;
  for (int m = 0; m < size; ++m)
    gram.products[m] = Lanes{};
  for (int j = 0; j < gram.count; ++j) {
    const std::size_t point = static_cast<std::size_t>(j) * static_cast<std::size_t>(gram.every);
    const Lanes* row = gram.rows + point * static_cast<std::size_t>(gram.row);
    const Lanes residual = gram.data[j] - gram.z[point] - row[0];
    Lanes* product = gram.products;
    *product++ += residual * residual;
    for (int k = 1; k < gram.width; ++k) {
      *product++ += row[k] * residual;
      for (int l = 1; l <= k; ++l)
        *product++ += row[k] * row[l];
    }
  }
}

SHAKER_SIMD_CLONES void advance_lanes(const LaneAdvance& move) {
  const Lanes* row = move.rows;
  const Lanes share = *move.share;
  Lanes step{};
  Lanes size{};
  for (int i = 0; i < move.n; ++i, row += move.row) {
    Lanes sum = row[0];
    keep_largest(step, sum);
    keep_largest(size, move.z[i]);
    for (int k = 1; k < move.width; ++k)
      sum += move.delta[k - 1] * row[k];
    move.z[i] += share * sum;
  }
  *move.newton_step = step / (size + 1e-300);
}

}  // namespace shaker::estimator
