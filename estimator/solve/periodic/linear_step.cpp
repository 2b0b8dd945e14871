// Newton step and sensitivities of a linearised system. Its solver is that of rings, that of bands
// with row exchanges, or the dense one of fourier_collocation.cpp.
#include <algorithm>
#include <cmath>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/solve/periodic/internal/dense.hpp"
#include "estimator/solve/periodic/internal/observer.hpp"
#include "estimator/solve/periodic/ring_step.hpp"

namespace shaker::estimator {
namespace {

SHAKER_SIMD_CLONES void fill_band(int n, int reach, const double* __restrict first,
                                  const double* __restrict second, const double* __restrict g_u,
                                  const double* __restrict g_v, const double* __restrict g_a,
                                  double* __restrict band) {
  Lanes over_v{};
  Lanes over_a{};
  Lanes over_u{};
  over_u[reach] = 1.0;
  for (int k = 0; k < kMostAcross; ++k) {
    over_v[k] = first[k];
    over_a[k] = second[k];
  }
  for (int i = 0; i < n; ++i)
    as_lanes(band)[i] = g_a[i] * over_a + g_v[i] * over_v + g_u[i] * over_u;
}

}  // namespace

void PeriodicSystem::learn_jumps() {
  model_->velocity_kink_gradient(theta_, &kappa_theta_[1]);
  reversals_->learn_sensitivities(rows_.data(), kappa_theta_.data());
}

void PeriodicSystem::fill_right_hand_sides() {
  const bool corrected = reversals_ && reversals_->any();
  if (corrected && rows_hold_sensitivities_) learn_jumps();
  if (ring_)
    for (int d = 0; d < s_; ++d)
      fill_ring_rows(
          {n_, 1 + p_, groups_, left_.data() + d * (1 + p_), rows_.data() + d * stride_, s_});
  else
    fill_rows();
  if (corrected) reversals_->correct_right_hand_sides(g_v_[0], g_a_[0], rows_.data());
  rows_hold_sensitivities_ = false;
}

void PeriodicSystem::fill_rows() {
  for (int i = 0; i < n_; ++i) {
    for (int d = 0; d < s_; ++d) {
      double* row = &rows_[static_cast<std::size_t>(i * s_ + d) * stride_];
      row[0] = -g_[d][i];
      for (int k = 0; k < p_; ++k)
        row[1 + k] = -g_theta_[d * p_ + k][i];
      std::fill(row + 1 + p_, row + stride_, 0.0);
    }
  }
}

bool PeriodicSystem::solve_step() {
  return solve_rows(true) && observe();
}

bool PeriodicSystem::observe() {
  return observer_->idle() || observer_->observe(*this, theta_);
}

bool PeriodicSystem::solve_rows(bool with_sensitivities) {
  if (dense_) return solve_dense();
  // The solver for rings has the sensitivities in the same registers, and the corrections at kinks
  // need those of the previous step.
  const bool all = with_sensitivities || ring_ || reversals_;
  if (!ring_ || !solve_ring()) {
    if (!solve_banded(all ? 1 + p_ : 1)) return false;
  }
  rows_hold_sensitivities_ = all;
  return true;
}

bool PeriodicSystem::solve_ring() {
  const double f1 = frequency_ * n_;
  double first[kMostBlock][kMostAcross], second[kMostBlock][kMostAcross];
  for (int c = 0; c < s_; ++c) {
    for (std::size_t k = 0; k < kMostAcross; ++k) {
      first[c][k] = stencil_of(c).first[k] * f1;
      second[c][k] = stencil_of(c).second[k] * f1 * f1;
    }
  }
  if (s_ == 1)
    fill_band(n_, stencil_.reach, first[0], second[0], g_u_[0], g_v_[0], g_a_[0], band_.data());
  else
    fill_block_band({n_, s_, stencil_.reach, g_u_.data(), g_v_.data(), g_a_.data(), first, second,
                     band_.data()});
  fill_right_hand_sides();
  return solve_ring_step(
      {n_, stencil_.reach, 1 + p_, groups_, band_.data(), upper_.data(), rows_.data(), s_});
}

bool PeriodicSystem::solve_banded(int columns) {
  if (!factorise_banded()) return false;
  fill_right_hand_sides();
  banded_->solve(rows_.data(), stride_, columns);
  return std::isfinite(rows_[0]);
}

bool PeriodicSystem::factorise_banded() {
  const double f1 = frequency_ * n_;
  const int reach = stencil_.reach;
  if (!banded_) banded_ = std::make_unique<CyclicBandedLu>(n_, s_, reach);
  banded_->clear();
  for (int i = 0; i < n_; ++i) {
    for (int d = 0; d < s_; ++d) {
      for (int e = 0; e < s_; ++e) {
        const int de = d * s_ + e;
        const Stencil& stencil = stencil_of(e);
        const double over_v = g_v_[de][i] * f1, over_a = g_a_[de][i] * f1 * f1;
        double values[kMostAcross];
        for (int k = 0; k <= 2 * reach; ++k)
          values[k] = over_a * stencil.second[k] + over_v * stencil.first[k];
        values[reach] += g_u_[de][i];
        banded_->add(i, d, e, values);
      }
    }
  }
  return banded_->factorise();
}

bool PeriodicSystem::excitation_response(int harmonics, std::vector<double>& out) {
  const int width = 2 * harmonics;
  out.assign(static_cast<std::size_t>(n_ * s_) * width, 0.0);
  for (int i = 0; i < n_; ++i) {
    for (int d = 0; d < s_; ++d) {
      double* row = &out[static_cast<std::size_t>(i * s_ + d) * width];
      for (int k = 0; k < width; ++k)
        row[k] = model_->excitation(d) * harmonic_term(k + 1, i, n_);
    }
  }
  if (!factorise()) return false;
  solve_factorised(out, width);
  return std::isfinite(out[0]);
}

bool PeriodicSystem::factorise() {
  if (!dense_) return factorise_banded();
  fill_dense();
  dense_->factorise();
  return true;
}

void PeriodicSystem::solve_factorised(std::span<double> rows, int width) {
  if (dense_) return dense_->solve(rows, width);
  banded_->solve(rows.data(), width, width);
}

void PeriodicSystem::solve_transposed(std::span<double> rows, int width) {
  if (dense_) return dense_->solve_transposed(rows, width);
  banded_->solve_transposed(rows.data(), width, width);
}

bool PeriodicSystem::add_products(std::span<const double> data, int every, bool with_newton,
                                  double weight, double* products) const {
  if (groups_ > kMostGroups || !observer_->direct(0)) return false;
  const int observed = model_->observed();
  shaker::estimator::add_products({static_cast<int>(data.size()), every * s_, p_, groups_,
                                   with_newton, rows_.data() + observed * stride_,
                                   z_.data() + observed, data.data(), weight, products});
  return true;
}

double PeriodicSystem::advance(double newton, std::span<const double> delta_theta) {
  const double step = ring_ ? advance_ring({n_ * s_, 1 + p_, groups_, newton, rows_.data(),
                                            delta_theta.data(), z_.data(), s_, model_->observed()})
                            : advance_rows(newton, delta_theta);
  if (!observer_->idle()) observer_->advance(newton, delta_theta);
  return step;
}

double PeriodicSystem::advance_rows(double newton, std::span<const double> delta_theta) {
  double largest_step = 0.0;
  double size = 1e-300;
  const int count = n_ * s_;
  for (int i = 0; i < count; ++i) {
    const double* row = &rows_[static_cast<std::size_t>(i) * stride_];
    if (i % s_ == model_->observed()) {
      largest_step = std::max(largest_step, std::fabs(row[0]));
      size = std::max(size, std::fabs(z_[i]));
    }
    double sum = newton * row[0];
    for (int k = 0; k < p_; ++k)
      sum += delta_theta[k] * row[1 + k];
    z_[i] += sum;
  }
  return largest_step / size;
}

}  // namespace shaker::estimator
