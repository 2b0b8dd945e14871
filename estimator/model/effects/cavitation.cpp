// sp_w(theta1 r v^2 - f_cav) - sp_w(-f_cav) on extension: oil cannot pull, which limits the
// damping force to f_cav. r is that of rebound_damping if the model has it, otherwise 1.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class Cavitation final : public DualEffect<Cavitation, kSeesV, 3> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_cav", "m/s^2", 2.0, 0.05, 1e3, "largest damping force on extension"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"w", "m/s^2", 0.1, "force over which the cut-off sets in", true},
  };
  static constexpr Borrowed kBorrowed[] = {{"orifice_damping", "theta1"},
                                           {"rebound_damping", "r", 1.0}};

  std::string_view name() const override { return "cavitation"; }
  std::string_view formula() const override { return "sp(theta1 r v^2 - f_cav) for v < 0"; }
  std::string_view meaning() const override { return "oil that cavitates on extension"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    f = T(0.0);
    if (at.v.value < 0.0)
      f = smooth_ramp(theta[1] * theta[2] * square(at.v) - theta[0], constants[0]) -
          smooth_ramp(-theta[0], constants[0]);
    return true;
  }
};

}  // namespace

const Effect& cavitation() {
  static const Cavitation effect;
  return effect;
}

}  // namespace shaker::estimator
