// c_p v |v / v_r|^(alpha - 1), rounded about v = 0: damping that follows a power of the velocity, per unit
// mass: fluids that thin under shear (silicone oil: alpha 0.1 to 0.5), valves on springs, and flow that is
// neither laminar (1) nor fully turbulent (2). alpha keeps off 0 and 2, which are dry friction and an
// orifice.
#include "estimator/math/simd_math.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

struct Law {
  double c, less, e, v_r;  // less: alpha - 1
};

SHAKER_SIMD_CLONES void add(int n, const Law& law, const double* __restrict v, double* __restrict f,
                            double* __restrict f_v, double* __restrict over_c,
                            double* __restrict over_alpha) {
  const double c = law.c, less = law.less, e2 = law.e * law.e, scale = 1.0 / (law.v_r * law.v_r);
  for (int i = 0; i < n; ++i) {
    const double square = v[i] * v[i] + e2;
    const double half_log = 0.5 * fast_log(square * scale);
    const double power = fast_exp(less * half_log);
    f[i] += c * v[i] * power;
    f_v[i] += c * power * (1.0 + less * v[i] * v[i] / square);
    over_c[i] = v[i] * power;
    over_alpha[i] = c * v[i] * power * half_log;
  }
}

class PowerDamping final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"c_p", "1/s", 1.0, 0.0, 1e6, "damping over mass at the velocity v_r", 0.0},
      {"alpha", "-", 0.4, 0.1, 1.8, "power of the velocity"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 2e-3, "velocity over which the force turns round", true},
      {"v_r", "m/s", 0.4, "velocity at which the damping is c_p", true},
  };

  std::string_view name() const override { return "power_damping"; }
  std::string_view formula() const override { return "c_p v |v / v_r|^(alpha - 1)"; }
  std::string_view meaning() const override {
    return "damping that follows a power of the velocity (a fluid that thins under shear)";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }

  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    add(at.n, {theta[0], theta[1] - 1.0, constants[0], constants[1]}, at.v, out.f, out.f_v,
        out.f_theta[0], out.f_theta[1]);
    return true;
  }
};

}  // namespace

const Effect& power_damping() {
  static const PowerDamping effect;
  return effect;
}

}  // namespace shaker::estimator
