// c_p v |v / v_r|^(alpha - 1), rounded about v = 0: damping that follows a power of the velocity, per unit
// mass: fluids that thin under shear (silicone oil: alpha 0.1 to 0.5), valves on springs, and flow that is
// neither laminar (1) nor fully turbulent (2). alpha keeps off 0 and 2, which are dry friction and an
// orifice.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class PowerDamping final : public DualEffect<PowerDamping, kSeesV, 2> {
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

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    using std::exp, std::log;
    const T speed = (square(at.v) + square(constants[0])) / square(constants[1]);
    f = theta[0] * at.v * exp(0.5 * (theta[1] - 1.0) * log(speed));
    return true;
  }
};

}  // namespace

const Effect& power_damping() {
  static const PowerDamping effect;
  return effect;
}

}  // namespace shaker::estimator
