// c_1 (v + |v|_w) / 2: laminar damping on compression only, per unit mass. Below 0 the damper
// has less of it there than on extension: valves of a shock absorber.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class OneSidedDamping final : public DualEffect<OneSidedDamping, kSeesV, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"c_1", "1/s", 1.0, -1e6, 1e6, "damping over mass on compression, more than on extension",
       0.0}};
  static constexpr ConstantInfo kConstants[] = {
      {"w", "m/s", 1e-3, "velocity over which the damping changes", true}};

  std::string_view name() const override { return "one_sided_damping"; }
  std::string_view formula() const override { return "c_1 v for v > 0"; }
  std::string_view meaning() const override {
    return "damping that differs between compression and extension (valves)";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    f = 0.5 * theta[0] * (at.v + smooth_abs(at.v, constants[0]));
    return true;
  }
};

}  // namespace

const Effect& one_sided_damping() {
  static const OneSidedDamping effect;
  return effect;
}

}  // namespace shaker::estimator
