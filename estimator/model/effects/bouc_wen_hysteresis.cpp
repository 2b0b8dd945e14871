// The Bouc-Wen hysteresis k z, z' = v - b |v|_e |z|^(n-1) z - c v |z|^n, in identifiable
// parameters: with s = z / z0, z0 = b^(-1/n), f_h = k z0 and gamma = c / b,
//     f_h s,     z0 s' = v - |s|^(n-1) (|v|_e s + gamma v |s|)
// b > 0, so that every loop dissipates energy. Along a stroke ds/du is 1 - (1 + gamma) |s|^n on
// loading and 1 + (1 - gamma) |s|^n on unloading. For gamma above -1 the loop softens, and |s|
// tends to (1 + gamma)^(-1/n), which is 1 for Dahl's friction (gamma = 0). For gamma below -1
// it hardens. With n = 1, |s| then stays under (exp(-(1 + gamma) u / z0) - 1) / -(1 + gamma)
// over a stroke of length u, because unloading is always steeper than loading. |s| is smoothed
// at 0 with the width r. Y. K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249-263. The benchmark
// of J. P. Noel and M. Schoukens has gamma = -1.375.
#include <cmath>

#include "estimator/math/simd_math.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

// With derivatives by hand: by dual numbers they take three times as long, and a diagnosis of
// hysteresis spends much of its time here.
SHAKER_SIMD_CLONES void add(int points, const double* theta, const double* widths,
                            const double* __restrict v, const double* __restrict s,
                            const double* __restrict rate, const Forces& out) {
  const double f_h = theta[0], z0 = theta[1], gamma = theta[2], sharper = theta[3] - 1.0;
  const double e2 = widths[0] * widths[0], r2 = widths[1] * widths[1];
  double* __restrict f = out.f;
  double* __restrict f_s = out.f_w[0];
  double* __restrict f_rate = out.f_w_dot[0];
  double* __restrict f_second = out.f_w_ddot[0];
  double* __restrict f_f_h = out.f_theta[0];
  double* __restrict f_z0 = out.f_theta[1];
  double* __restrict f_gamma = out.f_theta[2];
  double* __restrict f_n = out.f_theta[3];
  double* __restrict h = out.h[0];
  double* __restrict h_u = out.h_u[0];
  double* __restrict h_v = out.h_v[0];
  double* __restrict h_a = out.h_a[0];
  double* __restrict h_s = out.h_w[0];
  double* __restrict h_rate = out.h_w_dot[0];
  double* __restrict h_second = out.h_w_ddot[0];
  double* __restrict h_f_h = out.h_theta[0];
  double* __restrict h_z0 = out.h_theta[1];
  double* __restrict h_gamma = out.h_theta[2];
  double* __restrict h_n = out.h_theta[3];
  for (int i = 0; i < points; ++i) {
    const double size2 = s[i] * s[i] + r2;
    const double size = std::sqrt(size2), speed = std::sqrt(v[i] * v[i] + e2);
    const double logarithm = fast_log(size);
    const double power = fast_exp(sharper * logarithm);
    const double bracket = speed * s[i] + gamma * v[i] * size;
    f[i] += f_h * s[i];
    f_s[i] = f_h;
    f_f_h[i] = s[i];
    h[i] = z0 * rate[i] - v[i] + power * bracket;
    h_v[i] = power * (v[i] / speed * s[i] + gamma * size) - 1.0;
    h_s[i] = power * (speed + (gamma * v[i] * size + sharper * bracket) * s[i] / size2);
    h_rate[i] = z0;
    h_z0[i] = rate[i];
    h_gamma[i] = power * v[i] * size;
    h_n[i] = power * logarithm * bracket;
    f_rate[i] = f_second[i] = f_z0[i] = f_gamma[i] = f_n[i] = 0.0;
    h_u[i] = h_a[i] = h_second[i] = h_f_h[i] = 0.0;
  }
}

class BoucWenHysteresis final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_h", "m/s^2", 0.3, 0.0, 100.0, "force per unit mass at s = 1, k z0", 0.0},
      {"z0", "m", 2e-3, 5e-5, 0.1, "displacement over which it yields, b^(-1/n)"},
      {"gamma", "-", 0.5, -3.0, 5.0, "c / b: lean loop 1, fat 0, hardening below -1"},
      {"n", "-", 1.3, 1.0, 2.0, "sharpness of the knee"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 1e-3, "rounding of |v| about v = 0", true},
      {"r", "-", 0.02, "rounding of |s| about s = 0", true},
  };
  static constexpr InternalInfo kInternals[] = {
      {"s", "-", 1, 0.0, "hysteretic displacement over z0"},
  };

  std::string_view name() const override { return "bouc_wen_hysteresis"; }
  std::string_view formula() const override {
    return "f_h s,  z0 s' = v - |s|^(n-1) (|v|_e s + gamma v |s|)";
  }
  std::string_view meaning() const override {
    return "a force that depends on the history of the motion";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const InternalInfo> internals() const override { return kInternals; }

  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    add(at.n, theta, constants, at.v, at.w[0], at.w_dot[0], out);
    return true;
  }
};

}  // namespace

const Effect& bouc_wen_hysteresis() {
  static const BoucWenHysteresis effect;
  return effect;
}

}  // namespace shaker::estimator
