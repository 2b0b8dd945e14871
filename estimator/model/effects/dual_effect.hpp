/// \file
/// Base class of an effect that consists of its formula only. The partial derivatives come from
/// forward automatic differentiation. A derived class states what the formula sees and defines
/// it as a template:
/// \code
///   class EndStop final : public DualEffect<EndStop, kSeesU | kSeesV, 3> {
///     ...
///     template <class T>
///     static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f,
///                         T*) {
///       f = theta[0] * smooth_ramp(at.u - theta[1], constants[0]);
///       return true;
///     }
///   };
/// \endcode
///
/// `Parameters` counts own and borrowed ones. A formula returns false at an inadmissible point.
#pragma once

#include <array>

#include "estimator/math/dual.hpp"
#include "estimator/math/simd_math.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

/// What a formula sees: stroke (U), velocity (V), acceleration (A), excitation (X), internal
/// coordinates (W), their first and second derivatives over time (WDot, WDdot). Derivatives are
/// computed over these quantities only.
/// @{
inline constexpr unsigned kSeesU = 1, kSeesV = 2, kSeesA = 4, kSeesX = 8, kSeesW = 16,
                          kSeesWDot = 32, kSeesWDdot = 64;
/// @}

/// The harmonics of an excitation that has none.
inline constexpr std::array<double, 2 * kCarriedHarmonics> kNoHarmonics{};

/// What a formula sees at one point. T is double, or a Dual with its derivatives.
template <class T, int Internals>
struct Local {
  /// Stroke, velocity, acceleration and excitation: units as in Points.
  /// @{
  T u, v, a, x;
  /// @}
  /// Internal coordinates and their first and second derivatives over time.
  /// @{
  std::array<T, (Internals > 0 ? Internals : 1)> w, w_dot, w_ddot;
  /// @}
  /// The excitation's other data, as in Points.
  /// @{
  double x_quadrature = 0.0, carrier_cos = 0.0, carrier_sin = 0.0, carrier_amplitude = 0.0,
         carrier_omega = 0.0;
  /// @}
  const double* harmonics = kNoHarmonics.data();  ///< 2 * kCarriedHarmonics coefficients, m/s^2
};

/// An effect that consists of its formula. Formula: the derived class. Sees: the sum of the
/// kSees... flags. Parameters: own and borrowed ones. Internals: internal coordinates. Immutable;
/// all threads may use one object.
template <class Formula, unsigned Sees, int Parameters, int Internals = 0>
class DualEffect : public Effect {
 public:
  /// \return true if the formula sees the excitation
  bool sees_excitation() const override { return (Sees & kSeesX) != 0; }

  /// Adds the effect at all points, as Effect::evaluate().
  /// \param at n points
  /// \param theta own, then borrowed parameters
  /// \param constants in the order of constants()
  /// \param out arrays of n values
  /// \return true if all points are admissible
  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const final {
    return over_points(at, theta, constants, out);
  }

 private:
  static constexpr int place(unsigned what) {  // index of a quantity among the variables
    int at = 0;
    for (unsigned bit = 1; bit < what; bit *= 2)
      at += (Sees & bit) == 0 ? 0 : bit >= kSeesW ? Internals : 1;
    return at;
  }
  static constexpr int kFirstParameter = place(128);
  static constexpr int kVariables = kFirstParameter + Parameters;
  using D = Dual<(kVariables > 0 ? kVariables : 1)>;

  // `flatten` inlines all calls, so that they too are compiled for each instruction set.
  SHAKER_SIMD_CLONES __attribute__((flatten)) static bool over_points(const Points& at,
                                                                      const double* theta,
                                                                      const double* constants,
                                                                      const Forces& out) {
    std::array<D, Parameters + 1> parameters;
    for (int k = 0; k < Parameters; ++k)
      parameters[k] = D(theta[k], kFirstParameter + k);
    for (int i = 0; i < at.n; ++i) {
      Local<D, Internals> local;
      read(at, i, local);
      D f;
      std::array<D, Internals + 1> h;
      if (!Formula::formula(local, parameters.data(), constants, f, h.data())) return false;
      write(f, h.data(), i, out);
    }
    return true;
  }

  template <unsigned What>
  static D variable(double value, int k = 0) {
    if constexpr ((Sees & What) != 0) return D(value, place(What) + k);
    return D(value);
  }

  static void read(const Points& at, int i, Local<D, Internals>& local) {
    local.u = variable<kSeesU>(at.u[i]);
    local.v = variable<kSeesV>(at.v[i]);
    local.a = variable<kSeesA>(at.a[i]);
    for (int k = 0; k < Internals; ++k) {
      local.w[k] = variable<kSeesW>(at.w[k][i], k);
      local.w_dot[k] = variable<kSeesWDot>(at.w_dot[k][i], k);
      if constexpr ((Sees & kSeesWDdot) != 0)
        local.w_ddot[k] = variable<kSeesWDdot>(at.w_ddot[k][i], k);
    }
    if (at.x != nullptr) local.x = variable<kSeesX>(at.x[i]);
    if (at.carrier_cos != nullptr) {
      local.x_quadrature = at.x_quadrature[i];
      local.carrier_cos = at.carrier_cos[i];
      local.carrier_sin = at.carrier_sin[i];
      local.carrier_amplitude = at.carrier_amplitude;
      local.carrier_omega = at.carrier_omega;
      local.harmonics = at.harmonics;
    }
  }

  template <unsigned What>
  static double slope(const D& f, int k = 0) {
    if constexpr ((Sees & What) != 0) return f.d[place(What) + k];
    return 0.0;
  }

  static void write(const D& f, const D* h, int i, const Forces& out) {
    out.f[i] += f.value;
    if constexpr ((Sees & kSeesU) != 0) out.f_u[i] += f.d[place(kSeesU)];
    if constexpr ((Sees & kSeesV) != 0) out.f_v[i] += f.d[place(kSeesV)];
    if constexpr ((Sees & kSeesA) != 0) out.f_a[i] += f.d[place(kSeesA)];
    if constexpr ((Sees & kSeesX) != 0) {
      if (out.f_x != nullptr) out.f_x[i] = f.d[place(kSeesX)];
    }
    for (int p = 0; p < Parameters; ++p)
      out.f_theta[p][i] = f.d[kFirstParameter + p];
    for (int k = 0; k < Internals; ++k) {
      out.f_w[k][i] = slope<kSeesW>(f, k);
      out.f_w_dot[k][i] = slope<kSeesWDot>(f, k);
      out.f_w_ddot[k][i] = slope<kSeesWDdot>(f, k);
      const D& row = h[k];
      out.h[k][i] = row.value;
      out.h_u[k][i] = slope<kSeesU>(row);
      out.h_v[k][i] = slope<kSeesV>(row);
      out.h_a[k][i] = slope<kSeesA>(row);
      if constexpr ((Sees & kSeesX) != 0) out.h_x[k][i] = slope<kSeesX>(row);
      for (int l = 0; l < Internals; ++l) {
        out.h_w[k * Internals + l][i] = slope<kSeesW>(row, l);
        out.h_w_dot[k * Internals + l][i] = slope<kSeesWDot>(row, l);
        out.h_w_ddot[k * Internals + l][i] = slope<kSeesWDdot>(row, l);
      }
      for (int p = 0; p < Parameters; ++p)
        out.h_theta[k * Parameters + p][i] = row.d[kFirstParameter + p];
    }
  }
};

}  // namespace shaker::estimator
