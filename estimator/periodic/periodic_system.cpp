#include "estimator/periodic/periodic_system.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/math/simd_math.hpp"
#include "estimator/periodic/scalar_step.hpp"

namespace shaker::estimator {

// Fourier collocation: differentiation matrices and the dense Jacobian.
struct PeriodicSystem::Dense {
  Eigen::MatrixXd first, second, jacobian, right;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
};

namespace {

// Differentiation matrices of the trigonometric interpolant on n equal steps of [0, 1).
void fourier_matrices(int n, Eigen::MatrixXd& first, Eigen::MatrixXd& second) {
  first.setZero(n, n);
  second.setZero(n, n);
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

template <int Reach>
SHAKER_INLINE void difference(int n, const double* __restrict padded,
                              const double* __restrict first, const double* __restrict second,
                              double* __restrict v, double* __restrict a) {
  for (int i = 0; i < n; ++i) {
    double dv = 0.0;
    double da = 0.0;
    for (int k = 0; k <= 2 * Reach; ++k) {
      dv += first[k] * padded[i + k];
      da += second[k] * padded[i + k];
    }
    v[i] = dv;
    a[i] = da;
  }
}

SHAKER_SIMD_CLONES void difference_1(int n, const double* u, const double* first,
                                     const double* second, double* v, double* a) {
  difference<1>(n, u, first, second, v, a);
}
SHAKER_SIMD_CLONES void difference_2(int n, const double* u, const double* first,
                                     const double* second, double* v, double* a) {
  difference<2>(n, u, first, second, v, a);
}
SHAKER_SIMD_CLONES void difference_3(int n, const double* u, const double* first,
                                     const double* second, double* v, double* a) {
  difference<3>(n, u, first, second, v, a);
}
constexpr auto kDifference = std::array{difference_1, difference_2, difference_3};

SHAKER_SIMD_CLONES double largest(int n, const double* __restrict g) {
  double worst = 0.0;
  for (int i = 0; i < n; ++i)
    worst = std::max(worst, std::fabs(g[i]));
  return worst;
}

SHAKER_SIMD_CLONES void fill_band(int n, int reach, const double* __restrict first,
                                  const double* __restrict second, const double* __restrict g_u,
                                  const double* __restrict g_v, const double* __restrict g_a,
                                  double* __restrict band) {
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 8; ++k)
      band[8 * i + k] = g_a[i] * second[k] + g_v[i] * first[k];
    band[8 * i + reach] += g_u[i];
  }
}

}  // namespace

std::string SolveReport::sentence() const {
  switch (status) {
    case SolveStatus::converged:
      return "converged";
    case SolveStatus::no_equilibrium:
      return "the model has no static equilibrium at these parameters";
    case SolveStatus::inadmissible:
      return "the state is inadmissible: the stroke reaches the wall of the gas spring "
             "(1 - theta3 u <= 0)";
    case SolveStatus::singular:
      return "the linearised equations are singular";
    case SolveStatus::no_convergence:
      break;
  }
  return fmt::format(
      "no periodic solution was found at this excitation; the continuation in amplitude got to "
      "{:.0f} % of it",
      100.0 * amplitude_reached);
}

PeriodicSystem::PeriodicSystem(const Model& model, GridOptions options)
    : model_(&model),
      options_(options),
      stencil_(stencil(options.scheme)),
      n_(options.points),
      s_(model.coordinates()),
      p_(model.parameter_count()) {
  const int least = options.scheme == Scheme::fourier ? 3 : 3 * stencil_.reach + 2;
  if (n_ < least)
    throw std::invalid_argument(
        fmt::format("a grid of {} points is too coarse for scheme {}: it "
                    "needs at least {}",
                    n_, shaker::estimator::name(options.scheme), least));
  padded_ = (n_ + 7) / 8 * 8;
  groups_ = lane_groups(1 + p_, stencil_.reach);
  stride_ = groups_ * kLanes;
  z_.resize(static_cast<std::size_t>(n_) * s_);
  saved_.resize(z_.size());
  x_.resize(padded_);
  x_full_.resize(padded_);
  rows_.resize(static_cast<std::size_t>(n_) * s_ * stride_);
  const int arrays = 3 * s_ + s_ + 3 * s_ * s_ + s_ * p_ + (s_ > 1 ? 7 + p_ : 0);
  const int halo = 16;  // room for a stencil's neighbours around each array of u
  store_.resize(static_cast<std::size_t>(arrays) * (padded_ + 2 * halo));
  double* next = store_.data() + halo;
  const auto take = [&](std::vector<double*>& list, int count) {
    for (int i = 0; i < count; ++i, next += padded_ + 2 * halo)
      list.push_back(next);
  };
  take(u_, s_);
  take(v_, s_);
  take(a_, s_);
  take(g_, s_);
  take(g_u_, s_ * s_);
  take(g_v_, s_ * s_);
  take(g_a_, s_ * s_);
  take(g_theta_, s_ * p_);
  if (s_ > 1) take(scratch_, 7 + p_);
  if (options.scheme == Scheme::fourier) {
    dense_ = std::make_unique<Dense>();
    fourier_matrices(n_, dense_->first, dense_->second);
    dense_->jacobian.resize(n_ * s_, n_ * s_);
    dense_->right.resize(n_ * s_, 1 + p_);
  } else {
    banded_ = std::make_unique<CyclicBandedLu>(n_, s_, stencil_.reach);
    band_.resize(static_cast<std::size_t>(n_) * 8);
    upper_.resize(static_cast<std::size_t>(n_) * 4);
  }
}

PeriodicSystem::~PeriodicSystem() = default;
PeriodicSystem::PeriodicSystem(PeriodicSystem&&) noexcept = default;

void PeriodicSystem::set_excitation(double frequency_hz, double amplitude) {
  frequency_ = frequency_hz;
  for (int i = 0; i < n_; ++i)
    x_full_[i] = amplitude * std::cos(2.0 * std::numbers::pi * i / n_);
  x_ = x_full_;
}

void PeriodicSystem::set_excitation(double frequency_hz, std::span<const double> samples,
                                    int harmonics) {
  frequency_ = frequency_hz;
  const int count = static_cast<int>(samples.size());
  const int last = std::min(harmonics, (count - 1) / 2);
  std::fill(x_full_.begin(), x_full_.end(), 0.0);
  for (int h = 1; h <= last; ++h) {
    std::complex<double> c = 0.0;
    for (int j = 0; j < count; ++j)
      c += samples[j] * std::polar(2.0 / count, -2.0 * std::numbers::pi * (h * j % count) / count);
    for (int i = 0; i < n_; ++i)
      x_full_[i] += (c * std::polar(1.0, 2.0 * std::numbers::pi * (h * i % n_) / n_)).real();
  }
  x_ = x_full_;
}

// Trigonometric interpolation would ring at the kinks; four-point Lagrange is enough for a start.
void PeriodicSystem::interpolate_from(const PeriodicSystem& coarser) {
  const int m = coarser.n_;
  for (int i = 0; i < n_; ++i) {
    const double at = static_cast<double>(i) * m / n_;
    const int j = static_cast<int>(at);
    const double t = at - j;
    const double w[4] = {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2,
                         -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6};
    for (int c = 0; c < s_; ++c) {
      double sum = 0.0;
      for (int k = 0; k < 4; ++k)
        sum += w[k] * coarser.z_[((j - 1 + k + m) % m) * s_ + c];
      z_[i * s_ + c] = sum;
    }
  }
}

void PeriodicSystem::differentiate() {
  if (dense_) return differentiate_fourier();
  const int reach = stencil_.reach;
  double first[8] = {};
  double second[8] = {};
  const double f1 = frequency_ * n_;
  for (int k = 0; k <= 2 * reach; ++k) {
    first[k] = stencil_.first[k] * f1;
    second[k] = stencil_.second[k] * f1 * f1;
  }
  for (int c = 0; c < s_; ++c) {
    double* u = u_[c];
    for (int i = 0; i < n_; ++i)
      u[i] = z_[i * s_ + c];
    for (int k = 1; k <= reach; ++k) {
      u[-k] = u[n_ - k];
      u[n_ - 1 + k] = u[k - 1];
    }
    kDifference[static_cast<std::size_t>(reach - 1)](n_, u - reach, first, second, v_[c], a_[c]);
    for (int i = n_; i < padded_; ++i)
      u[i] = u[n_ - 1];  // no wild values in the padding
  }
}

void PeriodicSystem::differentiate_fourier() {
  for (int c = 0; c < s_; ++c) {
    for (int i = 0; i < n_; ++i)
      u_[c][i] = z_[i * s_ + c];
    const Eigen::Map<const Eigen::VectorXd> u(u_[c], n_);
    Eigen::Map<Eigen::VectorXd>(v_[c], n_).noalias() = frequency_ * (dense_->first * u);
    Eigen::Map<Eigen::VectorXd>(a_[c], n_).noalias() =
        frequency_ * frequency_ * (dense_->second * u);
  }
}

// At a zero t* of the velocity the force's second derivative over v jumps by `kink`, so that
//   [u'''' ] = -kink a |a|,   [u^(5)] = -3 kink |a| j      (a, j: acceleration, jerk at t*).
// A stencil that straddles t* is taken on the smooth continuation of its own side: the neighbours
// on the other side are shifted by the jump's Taylor terms.
void PeriodicSystem::correct_kinks(double kink) {
  const int reach = stencil_.reach;
  const double h = 1.0 / (frequency_ * n_);
  double* v = v_[0];
  double* a = a_[0];
  double crossing[16];
  double jump4[16];
  double jump5[16];
  int count = 0;
  for (int i = 0; i < n_ && count < 16; ++i) {
    const int next = i + 1 == n_ ? 0 : i + 1;
    if ((v[i] < 0.0) == (v[next] < 0.0)) continue;
    // Hermite cubic of v through v, a at both ends; two Newton steps from the secant.
    const double d = v[next] - v[i];
    const double m0 = h * a[i];
    const double m1 = h * a[next];
    double t = -v[i] / d;
    for (int it = 0; it < 2; ++it) {
      const double c2 = 3.0 * d - 2.0 * m0 - m1;
      const double c3 = m0 + m1 - 2.0 * d;
      const double value = v[i] + t * (m0 + t * (c2 + t * c3));
      const double slope = m0 + t * (2.0 * c2 + 3.0 * t * c3);
      if (slope != 0.0) t -= value / slope;
    }
    t = std::clamp(t, 0.0, 1.0);
    const double acceleration = a[i] + t * (a[next] - a[i]);
    const double jerk = (a[next] - a[i]) / h;
    crossing[count] = i + t;
    jump4[count] = -kink * acceleration * std::fabs(acceleration) / 24.0;
    jump5[count] = -3.0 * kink * std::fabs(acceleration) * jerk / 120.0;
    ++count;
  }
  const double f1 = frequency_ * n_;
  for (int c = 0; c < count; ++c) {
    const int base = static_cast<int>(crossing[c]);
    for (int i = base - reach + 1; i <= base + reach; ++i) {
      double dv = 0.0;
      double da = 0.0;
      for (int k = -reach; k <= reach; ++k) {
        const bool here = i <= base;       // this point is before the crossing
        const bool there = i + k <= base;  // so is the neighbour
        if (here == there) continue;
        const double distance = (i + k - crossing[c]) * h;
        const double d4 = distance * distance * distance * distance;
        const double shift = (jump4[c] + jump5[c] * distance) * d4;
        const double signed_shift = here ? -shift : shift;
        dv += stencil_.first[k + reach] * signed_shift;
        da += stencil_.second[k + reach] * signed_shift;
      }
      const int at = (i + n_) % n_;
      v[at] += f1 * dv;
      a[at] += f1 * f1 * da;
    }
  }
}

bool PeriodicSystem::linearise(std::span<const double> theta) {
  differentiate();
  if (options_.correct_kink && !dense_ && s_ == 1) {
    const double kink = model_->velocity_kink(theta.data());
    if (kink != 0.0) correct_kinks(kink);
  }
  const ModelPoints points{n_, u_.data(), v_.data(), a_.data(), x_.data()};
  const ModelForces forces{g_.data(),   g_u_.data(),     g_v_.data(),
                           g_a_.data(), g_theta_.data(), scratch_.data()};
  if (!model_->evaluate(points, theta.data(), forces)) return false;
  residual_ = 0.0;
  for (int d = 0; d < s_; ++d)
    residual_ = std::max(residual_, largest(n_, g_[d]));
  return std::isfinite(residual_);
}

void PeriodicSystem::fill_right_hand_sides() {
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
  if (dense_) return solve_dense();
  if (s_ == 1 && groups_ <= 4 && solve_scalar()) return true;
  return solve_banded();
}

bool PeriodicSystem::solve_scalar() {
  double first[8] = {};
  double second[8] = {};
  const double f1 = frequency_ * n_;
  for (int k = 0; k <= 2 * stencil_.reach; ++k) {
    first[k] = stencil_.first[k] * f1;
    second[k] = stencil_.second[k] * f1 * f1;
  }
  fill_band(n_, stencil_.reach, first, second, g_u_[0], g_v_[0], g_a_[0], band_.data());
  fill_right_hand_sides();
  return solve_scalar_step(
      {n_, stencil_.reach, 1 + p_, groups_, band_.data(), upper_.data(), rows_.data()});
}

bool PeriodicSystem::solve_banded() {
  if (!factorise_banded()) return false;
  fill_right_hand_sides();
  banded_->solve(rows_.data(), stride_, 1 + p_);
  return std::isfinite(rows_[0]);
}

bool PeriodicSystem::factorise_banded() {
  const double f1 = frequency_ * n_;
  const int reach = stencil_.reach;
  banded_->clear();
  for (int i = 0; i < n_; ++i) {
    for (int d = 0; d < s_; ++d) {
      for (int e = 0; e < s_; ++e) {
        const int de = d * s_ + e;
        for (int k = -reach; k <= reach; ++k)
          banded_->add(i, d, k, e,
                       g_a_[de][i] * stencil_.second[k + reach] * f1 * f1 +
                           g_v_[de][i] * stencil_.first[k + reach] * f1);
        banded_->add(i, d, 0, e, g_u_[de][i]);
      }
    }
  }
  return banded_->factorise();
}

void PeriodicSystem::fill_dense() {
  Eigen::MatrixXd& j = dense_->jacobian;
  for (int d = 0; d < s_; ++d) {
    for (int e = 0; e < s_; ++e) {
      const int de = d * s_ + e;
      for (int i = 0; i < n_; ++i) {
        for (int k = 0; k < n_; ++k)
          j(i * s_ + d, k * s_ + e) = g_a_[de][i] * frequency_ * frequency_ * dense_->second(i, k) +
                                      g_v_[de][i] * frequency_ * dense_->first(i, k) +
                                      (i == k ? g_u_[de][i] : 0.0);
      }
    }
  }
}

bool PeriodicSystem::solve_dense() {
  fill_dense();
  fill_right_hand_sides();
  using Rows = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>, 0,
                          Eigen::OuterStride<>>;
  Rows rows(rows_.data(), n_ * s_, 1 + p_, Eigen::OuterStride<>(stride_));
  dense_->lu.compute(dense_->jacobian);
  dense_->right = dense_->lu.solve(rows);
  rows = dense_->right;
  return dense_->right.allFinite();
}

bool PeriodicSystem::excitation_response(int harmonics, std::vector<double>& out) {
  const int width = 2 * harmonics;
  out.assign(static_cast<std::size_t>(n_ * s_) * width, 0.0);
  for (int i = 0; i < n_; ++i) {
    for (int d = 0; d < s_; ++d) {
      double* row = &out[static_cast<std::size_t>(i * s_ + d) * width];
      for (int h = 1; h <= harmonics; ++h) {
        const double angle = 2.0 * std::numbers::pi * (h * i % n_) / n_;
        row[2 * h - 2] = model_->excitation(d) * std::cos(angle);
        row[2 * h - 1] = model_->excitation(d) * std::sin(angle);
      }
    }
  }
  if (!dense_) {
    if (!factorise_banded()) return false;
    banded_->solve(out.data(), width, width);
    return std::isfinite(out[0]);
  }
  fill_dense();
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> rows(
      out.data(), n_ * s_, width);
  dense_->lu.compute(dense_->jacobian);
  rows = dense_->lu.solve(rows).eval();
  return rows.allFinite();
}

bool PeriodicSystem::add_products(std::span<const double> data, int every, bool with_newton,
                                  double weight, double* products) const {
  if (s_ != 1 || groups_ > 4) return false;
  shaker::estimator::add_products({static_cast<int>(data.size()), every, p_, groups_, with_newton,
                                   rows_.data(), z_.data(), data.data(), weight, products});
  return true;
}

void PeriodicSystem::advance(double newton, std::span<const double> delta_theta) {
  const int count = n_ * s_;
  for (int i = 0; i < count; ++i) {
    const double* row = &rows_[static_cast<std::size_t>(i) * stride_];
    double sum = newton * row[0];
    for (int k = 0; k < p_; ++k)
      sum += delta_theta[k] * row[1 + k];
    z_[i] += sum;
  }
}

}  // namespace shaker::estimator
