// A dead zone in the load path: stops of stiffness k with the play delta join damper and mass.
// The model separates the stroke of the damper from that of the mass (Effect::in_series). This
// effect is the load of the stops; it sees the difference y of the two strokes:
//     k [sp_w(y - delta / 2) - sp_w(-y - delta / 2)]
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class FreePlay final : public DualEffect<FreePlay, kSeesU, 2> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"delta", "m", 5e-4, 5e-5, 1e-2, "play between the stops"},
      {"k", "1/s^2", 2e4, 5e2, 1e6, "stiffness of the stops over mass"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"w", "m", 2e-5, "depth over which a stop is met", true},
  };

  std::string_view name() const override { return "free_play"; }
  std::string_view formula() const override {
    return "k (sp(y - delta / 2) - sp(-y - delta / 2)), y = stroke of the mass - stroke of the "
           "damper";
  }
  std::string_view meaning() const override { return "play in the joints of the load path"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool in_series() const override { return true; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    const T half = 0.5 * theta[0];
    f = theta[1] *
        (smooth_ramp(at.u - half, constants[0]) - smooth_ramp(-at.u - half, constants[0]));
    return true;
  }
};

}  // namespace

const Effect& free_play() {
  static const FreePlay effect;
  return effect;
}

}  // namespace shaker::estimator
