// P(u - kappa sp_w(u - u_k)) - P(u): beyond the stroke u_k a second gas chamber takes the share
// kappa of the further stroke.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"
#include "estimator/model/effects/internal/gas_pressure.hpp"

namespace shaker::estimator {
namespace {

class SecondChamber final : public DualEffect<SecondChamber, kSeesU, 5> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"kappa", "-", 0.05, 0.0, 1.0, "share of the stroke that the second chamber takes", 0.0},
      {"u_k", "m", 0.12, 0.0, 1.0, "stroke at which it sets in"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"w", "m", 1e-3, "stroke over which it sets in", true},
  };

  std::string_view name() const override { return "second_chamber"; }
  std::string_view formula() const override { return "P(u - kappa sp(u - u_k)) - P(u)"; }
  std::string_view meaning() const override {
    return "second gas chamber that softens the spring past a knee";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const Borrowed> borrows() const override { return kGasParameters; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    T both, first;
    const T eased = at.u - theta[0] * smooth_ramp(at.u - theta[1], constants[0]);
    if (!gas_pressure(at.u, theta + 2, first) || !gas_pressure(eased, theta + 2, both))
      return false;
    f = both - first;
    return true;
  }
};

}  // namespace

const Effect& second_chamber() {
  static const SecondChamber effect;
  return effect;
}

}  // namespace shaker::estimator
