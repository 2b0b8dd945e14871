// theta1 (r - 1) |v| v on extension only: a snubber or a rebound valve.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class ReboundDamping final : public DualEffect<ReboundDamping, kSeesV, 2> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"r", "-", 2.0, 0.2, 20.0, "damping on extension over that on compression", 1.0},
  };
  static constexpr Borrowed kBorrowed[] = {{"orifice_damping", "theta1"}};

  std::string_view name() const override { return "rebound_damping"; }
  std::string_view formula() const override { return "theta1 (r - 1) |v| v for v < 0"; }
  std::string_view meaning() const override {
    return "orifice that damps extension differently (snubber, rebound valve)";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }
  bool has_velocity_kink() const override { return true; }
  double velocity_kink(const double* theta, const double*, double) const override {
    return 2.0 * theta[1] * (theta[0] - 1.0);
  }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double*, T& f, T*) {
    f = T(0.0);
    if (at.v.value < 0.0) f = -theta[1] * (theta[0] - 1.0) * square(at.v);
    return true;
  }
};

}  // namespace

const Effect& rebound_damping() {
  static const ReboundDamping effect;
  return effect;
}

}  // namespace shaker::estimator
