// Dry friction with presliding: shear deforms the seal by z before it slides (Dahl's model;
// LuGre without its micro-viscous terms). With s = z / z0 in -1 .. 1:
//     f_c s,     z0 s' = v - |v|_e s
// P. R. Dahl, "A solid friction model", The Aerospace Corporation, TOR-0158(3107-18)-1, 1968.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class PreslidingFriction final
    : public DualEffect<PreslidingFriction, kSeesV | kSeesW | kSeesWDot, 2, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_c", "m/s^2", 0.3, 0.0, 20.0, "sliding friction per unit mass", 0.0},
      {"z0", "m", 5e-4, 5e-5, 5e-3, "shear of the seal at which it slides"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 1e-3, "rounding of |v| about v = 0", true},
  };
  static constexpr InternalInfo kInternals[] = {
      {"s", "-", 1, 0.0, "shear of the seal over z0"},
  };

  std::string_view name() const override { return "presliding_friction"; }
  std::string_view formula() const override { return "f_c s,  z0 s' = v - |v|_e s"; }
  std::string_view meaning() const override {
    return "dry friction of a seal that gives before it slides";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const InternalInfo> internals() const override { return kInternals; }

  template <class T>
  static bool formula(const Local<T, 1>& at, const T* theta, const double* constants, T& f, T* h) {
    f = theta[0] * at.w[0];
    h[0] = theta[1] * at.w_dot[0] - at.v + smooth_abs(at.v, constants[0]) * at.w[0];
    return true;
  }
};

}  // namespace

const Effect& presliding_friction() {
  static const PreslidingFriction effect;
  return effect;
}

}  // namespace shaker::estimator
