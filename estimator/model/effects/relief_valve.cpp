// -(1 - k) sp_w(theta1 |v| v - f_rel): on compression, the damping force above f_rel rises only
// k times as fast.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class ReliefValve final : public DualEffect<ReliefValve, kSeesV, 3> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_rel", "m/s^2", 3.0, 0.05, 1e3, "damping force at which the valve opens"},
      {"k", "-", 0.3, 0.0, 1.0, "slope past it over slope before", 1.0},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"w", "m/s^2", 0.1, "force over which the valve opens", true},
  };
  static constexpr Borrowed kBorrowed[] = {{"orifice_damping", "theta1"}};

  std::string_view name() const override { return "relief_valve"; }
  std::string_view formula() const override { return "-(1 - k) sp(theta1 |v| v - f_rel)"; }
  std::string_view meaning() const override {
    return "valve that limits the damping force on compression";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    f = (theta[1] - 1.0) * smooth_ramp(theta[2] * abs(at.v) * at.v - theta[0], constants[0]);
    return true;
  }
};

}  // namespace

const Effect& relief_valve() {
  static const ReliefValve effect;
  return effect;
}

}  // namespace shaker::estimator
