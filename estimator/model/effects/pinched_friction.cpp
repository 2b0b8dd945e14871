// f_c (1 - exp(-((u - u_c) / u_p)^2)) tanh(v / e): friction that is pinched at u_c, as where a worn
// guide or a joint with slack lets go. Its loop of force over stroke is narrow in the middle.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class PinchedFriction final : public DualEffect<PinchedFriction, kSeesU | kSeesV, 3> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_c", "m/s^2", 0.3, 0.0, 20.0, "friction per unit mass far from u_c", 0.0},
      {"u_c", "m", 0.12, -1.0, 1.0, "stroke at which there is no friction"},
      {"u_p", "m", 0.01, 5e-4, 0.025, "stroke from u_c within which it is less"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 2e-3, "velocity over which the friction turns round", true},
  };

  std::string_view name() const override { return "pinched_friction"; }
  std::string_view formula() const override {
    return "f_c (1 - exp(-((u - u_c) / u_p)^2)) tanh(v / e)";
  }
  std::string_view meaning() const override {
    return "dry friction that is less within a part of the stroke";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    const T apart = (at.u - theta[1]) / theta[2];
    f = theta[0] * (1.0 - exp(-square(apart))) * tanh(at.v / constants[0]);
    return true;
  }
};

}  // namespace

const Effect& pinched_friction() {
  static const PinchedFriction effect;
  return effect;
}

}  // namespace shaker::estimator
