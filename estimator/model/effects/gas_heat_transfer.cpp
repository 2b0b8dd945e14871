// The gas temperature T (1: that of the oil) as a state, instead of the polytropic force P:
//     theta2 T / (1 - theta3 u) - P
//     T' = (1 - T) / tau + (gamma - 1) T theta3 v / (1 - theta3 u)
// Slow motion is isothermal, fast motion adiabatic. theta4 no longer has an influence.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"
#include "estimator/model/effects/internal/gas_pressure.hpp"

namespace shaker::estimator {
namespace {

class GasHeatTransfer final
    : public DualEffect<GasHeatTransfer, kSeesU | kSeesV | kSeesW | kSeesWDot, 4, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"tau", "s", 1.0, 0.02, 30.0, "time in which the gas takes the temperature of the oil"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"gamma", "-", 1.4, "ratio of specific heats of the gas", true},
  };
  static constexpr InternalInfo kInternals[] = {
      {"T", "-", 1, 1.0, "gas temperature over that of the oil"},
  };
  static constexpr Borrowed kBorrowed[] = {
      {"gas_spring", "theta2"},
      {"gas_spring", "theta3"},
      {"gas_spring", "theta4", std::numeric_limits<double>::quiet_NaN(), true}};

  std::string_view name() const override { return "gas_heat_transfer"; }
  std::string_view formula() const override {
    return "theta2 T / (1 - theta3 u) - P,  T' = (1 - T) / tau + (gamma - 1) T theta3 v / (1 - "
           "theta3 u)";
  }
  std::string_view meaning() const override {
    return "gas that heats up and exchanges heat with the oil";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const InternalInfo> internals() const override { return kInternals; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }

  template <class T>
  static bool formula(const Local<T, 1>& at, const T* theta, const double* constants, T& f, T* h) {
    T pressure;
    if (!gas_pressure(at.u, theta + 1, pressure)) return false;
    const T column = 1.0 - theta[2] * at.u;
    const T warmed = (constants[0] - 1.0) * at.w[0] * theta[2] * at.v / column;
    f = theta[1] * at.w[0] / column - pressure;
    h[0] = at.w_dot[0] - (1.0 - at.w[0]) / theta[0] - warmed;
    return true;
  }
};

}  // namespace

const Effect& gas_heat_transfer() {
  static const GasHeatTransfer effect;
  return effect;
}

}  // namespace shaker::estimator
