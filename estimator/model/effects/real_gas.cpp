// beta P (P / theta2 - 1): second virial term, the deviation of a real gas from the polytrope. A
// constant covolume cannot be told apart from theta3 and is therefore no effect of its own.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"
#include "estimator/model/effects/internal/gas_pressure.hpp"

namespace shaker::estimator {
namespace {

class RealGas final : public DualEffect<RealGas, kSeesU, 4> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"beta", "-", 0.01, -0.2, 0.2, "deviation at twice the preload", 0.0},
  };

  std::string_view name() const override { return "real_gas"; }
  std::string_view formula() const override { return "beta P (P / theta2 - 1)"; }
  std::string_view meaning() const override { return "gas that is not ideal at high pressure"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const Borrowed> borrows() const override { return kGasParameters; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double*, T& f, T*) {
    T pressure;
    if (!gas_pressure(at.u, theta + 1, pressure)) return false;
    f = theta[0] * pressure * (pressure / theta[1] - 1.0);
    return true;
  }
};

}  // namespace

const Effect& real_gas() {
  static const RealGas effect;
  return effect;
}

}  // namespace shaker::estimator
