#include "estimator/solve/time/internal/lane_steps.hpp"

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {
namespace {

constexpr double kTowards[] = {0.5, 0.5, 1.0, 1.0 / 6.0};  // of the step, by stage
constexpr double kWeight[] = {1.0, 2.0, 2.0, 1.0};         // of the stage in the step

SHAKER_INLINE void multiply_add(int m, const Lanes& factor, const Lanes* a, const Lanes* b,
                                Lanes* sum) {
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < m; ++j) {
      Lanes product = a[i * m] * b[j];
      for (int k = 1; k < m; ++k)
        product += a[i * m + k] * b[k * m + j];
      sum[i * m + j] += factor * product;
    }
  }
}

// The equations of the derivatives are linear, so a step of theirs is s_new = phi s + sum over the
// stages of w h_theta.
SHAKER_INLINE void derive_lanes(const LaneStep& b, int first, Lanes* room) {
  const int m = b.states, size = m * m;
  const Lanes h = *as_lanes(b.h + first);
  const auto stride = static_cast<std::ptrdiff_t>(b.stride);
  Lanes *slopes = room, *w = room + kClassicStages * size, *phi = room + 2 * kClassicStages * size;
  for (int s = 0; s < kClassicStages; ++s) {
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < m; ++j) {
        slopes[s * size + i * m + j] = b.follows[i] < 0 ? *as_lanes(b.h_s[s][i * m + j] + first)
                                                        : Lanes(b.follows[i] == j ? 1.0 : 0.0);
        w[s * size + i * m + j] = i == j ? (kWeight[s] / 6.0) * h : Lanes(0.0);
      }
    }
  }
  for (int i = 0; i < size; ++i)
    phi[i] = i % (m + 1) == 0 ? 1.0 : 0.0;
  for (int s = kClassicStages - 1; s >= 0; --s) {
    if (s + 1 < kClassicStages)
      multiply_add(m, kTowards[s] * h, w + (s + 1) * size, slopes + (s + 1) * size, w + s * size);
    multiply_add(m, 1.0, w + s * size, slopes + s * size, phi);
  }
  for (int k = 0; k < b.columns; ++k) {
    for (int i = 0; i < m; ++i) {
      Lanes sum = 0.0;
      for (int j = 0; j < m; ++j)
        sum += phi[i * m + j] * *as_lanes(b.base + (m + j * b.columns + k) * stride + first);
      for (int j = 0; k >= m && j < m; ++j) {
        if (b.follows[j] >= 0) continue;
        for (int s = 0; s < kClassicStages; ++s)
          sum += w[s * size + i * m + j] *
                 *as_lanes(b.h_theta[s][j * (b.columns - m) + k - m] + first);
      }
      *as_lanes(b.y + (m + i * b.columns + k) * stride + first) = sum;
    }
  }
}

// One coordinate with a mass: slopes are (0, 1; a, b).
SHAKER_SIMD_CLONES void derive_oscillator(const LaneStep& step) {
  const auto stride = static_cast<std::ptrdiff_t>(step.stride);
  for (int first = 0; first < step.stride; first += kLanes) {
    const Lanes h = *as_lanes(step.h + first);
    Lanes phi[2][2], over[2][kClassicStages];
    for (int i = 0; i < 2; ++i) {
      Lanes phi_u = 1.0 - i, phi_v = 1.0 * i, of_u = 0.0, of_v = 0.0;  // the latter: w slopes
      for (int s = kClassicStages - 1; s >= 0; --s) {
        const Lanes direct = (kWeight[s] / 6.0) * h, later = kTowards[s] * h;
        const Lanes w_u = i == 0 ? direct + later * of_u : later * of_u;
        const Lanes w_v = i == 1 ? direct + later * of_v : later * of_v;
        of_u = w_v * *as_lanes(step.h_s[s][2] + first);
        of_v = w_u + w_v * *as_lanes(step.h_s[s][3] + first);
        phi_u += of_u;
        phi_v += of_v;
        over[i][s] = w_v;
      }
      phi[i][0] = phi_u;
      phi[i][1] = phi_v;
    }
    for (int k = 0; k < step.columns; ++k) {
      const Lanes u = *as_lanes(step.base + (2 + k) * stride + first);
      const Lanes v = *as_lanes(step.base + (2 + step.columns + k) * stride + first);
      Lanes new_u = phi[0][0] * u + phi[0][1] * v, new_v = phi[1][0] * u + phi[1][1] * v;
      for (int s = 0; k >= 2 && s < kClassicStages; ++s) {
        const Lanes slope = *as_lanes(step.h_theta[s][step.columns - 2 + k - 2] + first);
        new_u += over[0][s] * slope;
        new_v += over[1][s] * slope;
      }
      *as_lanes(step.y + (2 + k) * stride + first) = new_u;
      *as_lanes(step.y + (2 + step.columns + k) * stride + first) = new_v;
    }
  }
}
SHAKER_SIMD_CLONES void derive_any(const LaneStep& b) {
  for (int first = 0; first < b.stride; first += kLanes)
    derive_lanes(b, first, as_lanes(b.room));
}

}  // namespace

SHAKER_SIMD_CLONES void advance(const LaneStep& b, int stage) {
  const double towards = kTowards[stage], weight = kWeight[stage];
  for (int i = 0; i < b.states; ++i) {
    const double* rate = b.rate[i];
    if (b.follows[i] >= 0) rate = (stage == 0 ? b.base : b.y) + b.follows[i] * b.stride;
    const double* __restrict base = b.base + i * b.stride;
    double* __restrict y = b.y + i * b.stride;
    double* __restrict sum = b.sum + i * b.stride;
    for (int lane = 0; lane < b.stride; ++lane) {
      const double all = (stage == 0 ? 0.0 : sum[lane]) + weight * rate[lane];
      sum[lane] = all;
      y[lane] = base[lane] + towards * b.h[lane] * (stage == 3 ? all : rate[lane]);
    }
  }
}

void advance_derivatives(const LaneStep& step) {
  if (step.states == 2 && step.follows[0] == 1)
    derive_oscillator(step);
  else
    derive_any(step);
}

SeenRows seen_rows(const LaneStep& b, int seen) {
  const auto stride = static_cast<std::ptrdiff_t>(b.stride);
  return {b.y + (b.states + seen * b.columns) * stride, b.y + seen * stride};
}

SHAKER_SIMD_CLONES void see_between(const LaneStep& b, int seen, int speed, double share,
                                    double* rows) {
  const double s2 = share * share, s3 = s2 * share;
  const double at_base = 2 * s3 - 3 * s2 + 1, at_y = 3 * s2 - 2 * s3;
  const double rate_at_base = s3 - 2 * s2 + share, rate_at_y = s3 - s2;
  for (int k = 0; k <= b.columns; ++k) {
    const int value = k < b.columns ? b.states + seen * b.columns + k : seen;
    const int rate = k < b.columns ? b.states + speed * b.columns + k : speed;
    const double* __restrict v0 = b.base + value * b.stride;
    const double* __restrict v1 = b.y + value * b.stride;
    const double* __restrict d0 = b.base + rate * b.stride;
    const double* __restrict d1 = b.y + rate * b.stride;
    double* __restrict to = rows + k * b.stride;
    for (int i = 0; i < b.stride; ++i)
      to[i] = at_base * v0[i] + at_y * v1[i] + b.h[i] * (rate_at_base * d0[i] + rate_at_y * d1[i]);
  }
}

SHAKER_SIMD_CLONES void add_products(const LaneStep& b, const SeenRows& rows, const LaneData& data,
                                     double* products) {
  const auto stride = static_cast<std::ptrdiff_t>(b.stride);
  const Lanes at = data.node, zero = 0.0;
  for (int first = 0; first < b.stride; first += kLanes) {
    LaneMask counts = (at >= *as_lanes(data.from + first)) & (at < *as_lanes(data.to + first));
    if (data.moving) counts &= *as_lanes(b.h + first) > zero;
    const double* derivatives = rows.derivatives + first;
    const Lanes error =
        chosen(counts, *as_lanes(data.measured + first) - *as_lanes(rows.state + first), zero);
    double* sum = products + first;
    for (int i = 0; i < b.columns; ++i) {
      const Lanes one = chosen(counts, *as_lanes(derivatives + i * stride), zero);
      for (int j = i; j < b.columns; ++j, sum += stride)
        *as_lanes(sum) += one * *as_lanes(derivatives + j * stride);
      *as_lanes(sum) += one * error;
      sum += stride;
    }
    *as_lanes(sum) += error * error;
  }
}

SHAKER_SIMD_CLONES std::uint64_t sign_changes(const double* a, const double* b, int stride) {
  std::uint64_t bits = 0;
  const Lanes zero = 0.0;
  for (int first = 0; first < stride; first += kLanes)
    bits |= std::uint64_t{bits_of(*as_lanes(a + first) * *as_lanes(b + first) < zero)} << first;
  return bits;
}

SHAKER_SIMD_CLONES void lane_steps(const double* __restrict before, const double* __restrict after,
                                   const double* __restrict last, double end, double share,
                                   int stride, double* __restrict h) {
  for (int i = 0; i < stride; ++i)
    h[i] = end <= last[i] ? (after[i] - before[i]) * share : 0.0;
}

}  // namespace shaker::estimator
