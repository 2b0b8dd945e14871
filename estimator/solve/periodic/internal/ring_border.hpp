// The border of a ring's elimination (ring_step.hpp): the last `reach` points, each of `block`
// unknowns. Private to the sources of ring_step.hpp. The functions take a FixedShape, or a
// Shape where one function for any number of groups is as fast.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>

#include "estimator/solve/periodic/ring_step.hpp"

namespace shaker::estimator {

// A pivot below this share of its row's diagonal entry before elimination loses too many digits.
inline constexpr double kSmallestPivot = 1e-5;

template <int Block, int Reach, int Groups>
struct FixedShape {
  static constexpr int block = Block, reach = Reach, groups = Groups;
  static constexpr int kMostSize = Block * Reach;
  static constexpr int kMostGroups = Groups;
};
template <int Block, int Reach>
struct Shape {
  static constexpr int block = Block, reach = Reach;
  int groups;
  static constexpr int kMostSize = Block * Reach;
  static constexpr int kMostGroups = estimator::kMostGroups;
};

// The border's equations: coefficients and right-hand sides.
template <class AShape>
struct Border {
  double s[AShape::kMostSize][AShape::kMostSize] = {};
  Lanes b[AShape::kMostSize][AShape::kMostGroups];
};

// Solves them, with whole rows b, by Gaussian elimination with row exchanges.
template <class AShape>
SHAKER_INLINE bool solve_border(const AShape& shape, Border<AShape>& border) {
  const int size = shape.block * shape.reach;
  const int groups = shape.groups;
  auto& s = border.s;
  auto& b = border.b;
  for (int k = 0; k < size; ++k) {
    int best = k;
    for (int r = k + 1; r < size; ++r) {
      if (std::fabs(s[r][k]) > std::fabs(s[best][k])) best = r;
    }
    if (!(std::fabs(s[best][k]) > 0.0)) return false;
    if (best != k) {
      for (int c = 0; c < size; ++c)
        std::swap(s[k][c], s[best][c]);
      for (int w = 0; w < groups; ++w)
        std::swap(b[k][w], b[best][w]);
    }
    for (int r = k + 1; r < size; ++r) {
      const double m = s[r][k] / s[k][k];
      for (int c = k + 1; c < size; ++c)
        s[r][c] -= m * s[k][c];
      for (int w = 0; w < groups; ++w)
        b[r][w] -= m * b[k][w];
    }
  }
  for (int k = size - 1; k >= 0; --k) {
    for (int c = k + 1; c < size; ++c) {
      for (int w = 0; w < groups; ++w)
        b[k][w] -= s[k][c] * b[c][w];
    }
    const double inverse = 1.0 / s[k][k];
    for (int w = 0; w < groups; ++w)
      b[k][w] *= inverse;
  }
  return true;
}

// The ring's arrays by point i and equation or unknown d of it.
template <class AShape>
struct RingView {
  const AShape& shape;
  const RingStep& step;

  // Coefficient of unknown e, k points ahead.
  SHAKER_INLINE double coefficient(int i, int d, int k, int e) const {
    return step.band[static_cast<std::size_t>((i * shape.block + d) * 8 + shape.reach + k) *
                         static_cast<std::size_t>(packed(shape.block)) +
                     static_cast<std::size_t>(e)];
  }
  SHAKER_INLINE double* lanes(int i, int d) const {
    return step.rows + static_cast<std::size_t>((i * shape.block + d) * shape.groups * kLanes);
  }
  SHAKER_INLINE Lanes* row(int i, int d) const { return reinterpret_cast<Lanes*>(lanes(i, d)); }
};

// Copies the couplings to the border into extra right-hand sides, lanes `width` and after. They
// stay in the band too, but there they only multiply rows of zeros.
template <class AShape>
SHAKER_INLINE void fill_border(const AShape& shape, const RingStep& step, int inner) {
  const RingView<AShape> ring{shape, step};
  const int block = shape.block, reach = shape.reach;
  for (int i = 0; i < reach; ++i) {
    for (int d = 0; d < block; ++d) {
      double* lanes = ring.lanes(i, d) + step.width;
      for (int k = -reach; i + k < 0; ++k) {
        for (int e = 0; e < block; ++e)
          lanes[(reach + i + k) * block + e] = ring.coefficient(i, d, k, e);
      }
      const int j = inner - reach + i;
      lanes = ring.lanes(j, d) + step.width;
      for (int k = inner - j; k <= reach; ++k) {
        for (int e = 0; e < block; ++e)
          lanes[(j + k - inner) * block + e] = ring.coefficient(j, d, k, e);
      }
    }
  }
}

// Solves the border's equations, with the inner unknowns solved for all right-hand sides and for
// the border's columns, and inserts the solution.
template <class AShape>
SHAKER_INLINE bool close_border(const AShape& shape, const RingStep& step, int inner) {
  const int block = shape.block, reach = shape.reach, groups = shape.groups;
  const int size = block * reach;
  const int width = step.width;
  const RingView<AShape> ring{shape, step};
  Border<AShape> border;
  for (int b = 0; b < size; ++b) {
    const int i = inner + b / block;
    for (int w = 0; w < groups; ++w)
      border.b[b][w] = ring.row(i, b % block)[w];
    for (int k = -reach; k <= reach; ++k) {
      int j = i + k;
      if (j >= step.n) j -= step.n;
      for (int e = 0; e < block; ++e) {
        const double value = ring.coefficient(i, b % block, k, e);
        if (j >= inner) {
          border.s[b][(j - inner) * block + e] += value;
          continue;
        }
        const double* lanes = ring.lanes(j, e) + width;
        for (int c = 0; c < size; ++c)
          border.s[b][c] -= value * lanes[c];
        for (int w = 0; w < groups; ++w)
          border.b[b][w] -= value * ring.row(j, e)[w];
      }
    }
  }
  if (!solve_border(shape, border)) return false;
  // Groups that hold nothing but the border's columns are not needed again.
  const int used = block == 1 ? groups : (width + kLanes - 1) / kLanes;
  for (int i = 0; i < inner; ++i) {
    for (int d = 0; d < block; ++d) {
      const double* lanes = ring.lanes(i, d) + width;
      double y[AShape::kMostSize];
      for (int b = 0; b < size; ++b)
        y[b] = lanes[b];
      for (int w = 0; w < used; ++w) {
        Lanes sum = ring.row(i, d)[w];
        for (int b = 0; b < size; ++b)
          sum -= y[b] * border.b[b][w];
        ring.row(i, d)[w] = sum;
      }
    }
  }
  for (int b = 0; b < size; ++b) {
    for (int w = 0; w < groups; ++w)
      ring.row(inner + b / block, b % block)[w] = border.b[b][w];
  }
  return true;
}

}  // namespace shaker::estimator
