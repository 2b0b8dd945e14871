// f_c [1 + (ratio - 1) exp(-(v / v_s)^2)] tanh(v / e): dry friction with a static peak (Stribeck).
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class StribeckFriction final : public DualEffect<StribeckFriction, kSeesV, 3> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_c", "m/s^2", 0.3, 0.0, 20.0, "sliding friction per unit mass", 0.0},
      {"ratio", "-", 1.3, 1.0, 2.0, "static over sliding friction"},
      {"v_s", "m/s", 0.02, 2e-3, 0.1, "velocity at which the static peak has gone"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 2e-3, "velocity over which the friction turns round", true},
  };

  std::string_view name() const override { return "stribeck_friction"; }
  std::string_view formula() const override {
    return "f_c (1 + (ratio - 1) exp(-(v / v_s)^2)) tanh(v / e)";
  }
  std::string_view meaning() const override { return "dry friction that is larger at slow motion"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    const T peak = (theta[1] - 1.0) * exp(-square(at.v / theta[2]));
    f = theta[0] * (1.0 + peak) * tanh(at.v / constants[0]);
    return true;
  }
};

}  // namespace

const Effect& stribeck_friction() {
  static const StribeckFriction effect;
  return effect;
}

}  // namespace shaker::estimator
