// mu P tanh(v / e): friction of seals that the gas pressure loads. P is the force of gas_spring.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"
#include "estimator/model/effects/internal/gas_pressure.hpp"

namespace shaker::estimator {
namespace {

class PressureFriction final : public DualEffect<PressureFriction, kSeesU | kSeesV, 4> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"mu", "-", 0.03, 0.0, 0.2, "friction over gas force", 0.0},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 5e-3, "velocity over which the friction turns round", true},
  };

  std::string_view name() const override { return "pressure_friction"; }
  std::string_view formula() const override {
    return "mu theta2 (1 - theta3 u)^(-theta4) tanh(v / e)";
  }
  std::string_view meaning() const override { return "friction of seals that the gas presses on"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const Borrowed> borrows() const override { return kGasParameters; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    T pressure;
    if (!gas_pressure(at.u, theta + 1, pressure)) return false;
    f = theta[0] * pressure * tanh(at.v / constants[0]);
    return true;
  }
};

}  // namespace

const Effect& pressure_friction() {
  static const PressureFriction effect;
  return effect;
}

}  // namespace shaker::estimator
