// theta1 |v| v [(1 - k1 xi - k2 xi^2)^-2 - 1], xi = u / stroke: a pin narrows the orifice along
// the stroke. A stroke at which the pin closes it is inadmissible.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class MeteringPin final : public DualEffect<MeteringPin, kSeesU | kSeesV, 3> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k1", "-", 0.1, 0.0, 0.8, "share of the orifice closed at full stroke, linear part", 0.0},
      {"k2", "-", 0.0, 0.0, 0.8, "the same, quadratic part", 0.0},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"stroke", "m", 0.2, "full stroke of the damper", true, true},
  };
  static constexpr Borrowed kBorrowed[] = {{"orifice_damping", "theta1"}};

  std::string_view name() const override { return "metering_pin"; }
  std::string_view formula() const override {
    return "theta1 |v| v ((1 - k1 xi - k2 xi^2)^-2 - 1), xi = u / stroke";
  }
  std::string_view meaning() const override {
    return "orifice that narrows along the stroke (metering pin)";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }
  bool has_velocity_kink() const override { return true; }
  double velocity_kink(const double* theta, const double* constants, double u) const override {
    const double xi = u / constants[0];
    const double open = 1.0 - theta[0] * xi - theta[1] * xi * xi;
    return 4.0 * theta[2] * (1.0 / (open * open) - 1.0);
  }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    const T xi = at.u / constants[0];
    const T open = 1.0 - theta[0] * xi - theta[1] * square(xi);
    if (!(open.value > 1e-3)) return false;
    f = theta[2] * abs(at.v) * at.v * (1.0 / square(open) - 1.0);
    return true;
  }
};

}  // namespace

const Effect& metering_pin() {
  static const MeteringPin effect;
  return effect;
}

}  // namespace shaker::estimator
