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
#include <algorithm>
#include <cmath>

#include "estimator/math/simd_math.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

struct Loop {
  double f_h, z0, gamma, n, e, r;
};

// With derivatives by hand: by dual numbers they take three times as long, and a diagnosis of
// hysteresis spends much of its time here.
SHAKER_SIMD_CLONES void add(int points, const Loop& loop, const double* __restrict v,
                            const double* __restrict s, const double* __restrict rate,
                            double* __restrict f, double* __restrict h, double* __restrict h_v,
                            double* __restrict h_s, double* __restrict h_gamma,
                            double* __restrict h_n) {
  const double f_h = loop.f_h, z0 = loop.z0, gamma = loop.gamma, sharper = loop.n - 1.0;
  const double e2 = loop.e * loop.e, r2 = loop.r * loop.r;
  for (int i = 0; i < points; ++i) {
    const double size2 = s[i] * s[i] + r2;
    const double size = std::sqrt(size2), speed = std::sqrt(v[i] * v[i] + e2);
    const double logarithm = fast_log(size);
    const double power = fast_exp(sharper * logarithm);
    const double bracket = speed * s[i] + gamma * v[i] * size;
    f[i] += f_h * s[i];
    h[i] = z0 * rate[i] - v[i] + power * bracket;
    h_v[i] = power * (v[i] / speed * s[i] + gamma * size) - 1.0;
    h_s[i] = power * (speed + (gamma * v[i] * size + sharper * bracket) * s[i] / size2);
    h_gamma[i] = power * v[i] * size;
    h_n[i] = power * logarithm * bracket;
  }
}

void copy(int points, const double* from, double* to) {
  if (points == 1) *to = *from;  // in a march through time; a call would be dear
  if (points > 1) std::copy_n(from, points, to);
}
void fill(int points, double value, double* to) {
  if (points == 1) *to = value;
  if (points > 1) std::fill_n(to, points, value);
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
    const Loop loop{theta[0], theta[1], theta[2], theta[3], constants[0], constants[1]};
    add(at.n, loop, at.v, at.w[0], at.w_dot[0], out.f, out.h[0], out.h_v[0], out.h_w[0],
        out.h_theta[2], out.h_theta[3]);
    copy(at.n, at.w[0], out.f_theta[0]);
    copy(at.n, at.w_dot[0], out.h_theta[1]);
    fill(at.n, theta[0], out.f_w[0]);
    fill(at.n, theta[1], out.h_w_dot[0]);
    for (double* nothing :
         {out.f_w_dot[0], out.f_w_ddot[0], out.f_theta[1], out.f_theta[2], out.f_theta[3],
          out.h_u[0], out.h_a[0], out.h_w_ddot[0], out.h_theta[0]})
      fill(at.n, 0.0, nothing);
    return true;
  }
};

}  // namespace

const Effect& bouc_wen_hysteresis() {
  static const BoucWenHysteresis effect;
  return effect;
}

}  // namespace shaker::estimator
