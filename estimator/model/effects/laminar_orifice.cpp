// Laminar flow below v_c: theta1 v sqrt((v^2 + sqrt(v^4 + 4 v_c^4)) / 2) instead of
// theta1 |v| v. It removes the jump of |v| v at a velocity reversal.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class LaminarOrifice final : public DualEffect<LaminarOrifice, kSeesV, 2> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"v_c", "m/s", 0.03, 1e-3, 0.5, "velocity below which the flow is laminar"},
  };
  static constexpr Borrowed kBorrowed[] = {{"orifice_damping", "theta1"}};

  std::string_view name() const override { return "laminar_orifice"; }
  std::string_view formula() const override {
    return "theta1 v (sqrt((v^2 + sqrt(v^4 + 4 v_c^4)) / 2) - |v|)";
  }
  std::string_view meaning() const override {
    return "laminar flow through the orifice at low speed";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }
  bool has_velocity_kink() const override { return true; }
  double velocity_kink(const double* theta, const double*, double) const override {
    return -4.0 * theta[1];
  }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double*, T& f, T*) {
    const T v2 = square(at.v);
    const T laminar = 4.0 * square(square(theta[0]));
    f = theta[1] * at.v * (sqrt(0.5 * (v2 + sqrt(v2 * v2 + laminar))) - abs(at.v));
    return true;
  }
};

}  // namespace

const Effect& laminar_orifice() {
  static const LaminarOrifice effect;
  return effect;
}

}  // namespace shaker::estimator
