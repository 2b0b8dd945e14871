// f_c tanh(v / e): dry friction, smoothed over the velocity e so that it has a derivative.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class CoulombFriction final : public DualEffect<CoulombFriction, kSeesV, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_c", "m/s^2", 0.3, 0.0, 20.0, "friction per unit mass", 0.0},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 5e-3, "velocity over which the friction turns round", true},
  };

  std::string_view name() const override { return "coulomb_friction"; }
  std::string_view formula() const override { return "f_c tanh(v / e)"; }
  std::string_view meaning() const override { return "dry friction of seals and bearings"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    f = theta[0] * tanh(at.v / constants[0]);
    return true;
  }
};

}  // namespace

const Effect& coulomb_friction() {
  static const CoulombFriction effect;
  return effect;
}

}  // namespace shaker::estimator
