// Gas dissolves in the oil and leaves it (Henry's law, with a time constant). m is the mass of
// free gas relative to that at rest:
//     (m - 1) P,     tau m' = 1 - s (m P / theta2 - 1) - m
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"
#include "estimator/model/effects/internal/gas_pressure.hpp"

namespace shaker::estimator {
namespace {

class DissolvedGas final : public DualEffect<DissolvedGas, kSeesU | kSeesW | kSeesWDot, 5, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"s", "-", 0.05, 0.0, 0.5, "share of the gas that dissolves at twice the preload", 0.0},
      {"tau", "s", 1.0, 0.02, 100.0, "time in which it dissolves"},
  };
  static constexpr InternalInfo kInternals[] = {
      {"m", "-", 1, 1.0, "free gas over that at rest"},
  };

  std::string_view name() const override { return "dissolved_gas"; }
  std::string_view formula() const override {
    return "(m - 1) P,  tau m' = 1 - s (m P / theta2 - 1) - m";
  }
  std::string_view meaning() const override {
    return "gas that dissolves in the oil under pressure";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const InternalInfo> internals() const override { return kInternals; }
  std::span<const Borrowed> borrows() const override { return kGasParameters; }

  template <class T>
  static bool formula(const Local<T, 1>& at, const T* theta, const double*, T& f, T* h) {
    T pressure;
    if (!gas_pressure(at.u, theta + 2, pressure)) return false;
    f = (at.w[0] - 1.0) * pressure;
    h[0] =
        theta[1] * at.w_dot[0] - 1.0 + at.w[0] + theta[0] * (at.w[0] * pressure / theta[2] - 1.0);
    return true;
  }
};

}  // namespace

const Effect& dissolved_gas() {
  static const DissolvedGas effect;
  return effect;
}

}  // namespace shaker::estimator
