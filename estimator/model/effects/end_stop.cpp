// k sp_w(u - u_s) + d H_w(u - u_s) v: a buffer at the end of the stroke. The width w smooths the
// contact.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class EndStop final : public DualEffect<EndStop, kSeesU | kSeesV, 3> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k", "1/s^2", 500.0, 0.0, 1e5, "stiffness of the buffer over mass", 0.0},
      {"d", "1/s", 0.0, 0.0, 1e3, "damping of the buffer over mass", 0.0},
      {"u_s", "m", 0.15, 0.0, 1.0, "stroke at which it is met"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"w", "m", 1e-3, "stroke over which it is met", true},
  };

  std::string_view name() const override { return "end_stop"; }
  std::string_view formula() const override { return "k sp(u - u_s) + d H(u - u_s) v"; }
  std::string_view meaning() const override { return "buffer at the end of the stroke"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double* constants, T& f, T*) {
    const T depth = at.u - theta[2];
    f = theta[0] * smooth_ramp(depth, constants[0]) +
        theta[1] * smooth_step(depth, constants[0]) * at.v;
    return true;
  }
};

}  // namespace

const Effect& end_stop() {
  static const EndStop effect;
  return effect;
}

}  // namespace shaker::estimator
