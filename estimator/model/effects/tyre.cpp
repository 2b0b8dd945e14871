// The damper stands on an unsprung mass with a tyre, not on the table. This adds a degree of
// freedom y, the deflection of the tyre. With r the unsprung over the sprung mass, the equation
// of the sprung mass gets y'', and
//     (1 + r) (y'' - x - g) + c_t y' + k_t y + u'' = 0
// is the balance of both masses. Valid for one coordinate with mass 1 and excitation 1. Other
// systems need coordinates in the model file (config/examples/model-oleo-on-tyre.json).
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class Tyre final
    : public DualEffect<Tyre, kSeesA | kSeesX | kSeesW | kSeesWDot | kSeesWDdot, 3, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"r", "-", 0.1, 0.005, 1.0, "unsprung over sprung mass"},
      {"k_t", "1/s^2", 2000.0, 50.0, 1e6, "stiffness of the tyre over sprung mass"},
      {"c_t", "1/s", 2.0, 0.0, 1e3, "damping of the tyre over sprung mass"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"g", "m/s^2", 9.80665, "acceleration of gravity (the model's)"},
      {"shaken", "-", 1.0, "1: the tyre stands on the table; 0: on ground that rests"},
  };
  static constexpr InternalInfo kInternals[] = {
      {"y", "m", 2, 0.0, "deflection of the tyre"},
  };

  std::string_view name() const override { return "tyre"; }
  std::string_view formula() const override {
    return "y'',  (1 + r) (y'' - x - g) + c_t y' + k_t y + u'' = 0";
  }
  std::string_view meaning() const override {
    return "an unsprung mass on a tyre under the damper";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const InternalInfo> internals() const override { return kInternals; }
  bool carries_load() const override { return false; }
  bool moves_base() const override { return true; }

  template <class T>
  static bool formula(const Local<T, 1>& at, const T* theta, const double* constants, T& f, T* h) {
    f = at.w_ddot[0];
    h[0] = (1.0 + theta[0]) * (at.w_ddot[0] - constants[1] * at.x - constants[0]) +
           theta[2] * at.w_dot[0] + theta[1] * at.w[0] + at.a;
    return true;
  }
};

}  // namespace

const Effect& tyre() {
  static const Tyre effect;
  return effect;
}

}  // namespace shaker::estimator
