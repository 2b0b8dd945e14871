// k5 (u - u0)^5: what a spring of large stroke has beside its cubic stiffness, per unit mass. The
// weight of a pendulum, g sin(u), has k5 = 0.3 (k3 / k)^2 k beside a cubic stiffness of the other sign.
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class QuinticStiffness final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k5", "1/(m^4 s^2)", 1.0, -1e16, 1e16, "quintic stiffness over mass", 0.0}};
  static constexpr ConstantInfo kConstants[] = {
      {"u0", "m", 0.0, "stroke at which the force vanishes"}};

  std::string_view name() const override { return "quintic_stiffness"; }
  std::string_view formula() const override { return "k5 (u - u0)^5"; }
  std::string_view meaning() const override {
    return "a spring that stiffens far from its centre";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      const double stretch = at.u[i] - constants[0];
      const double square = stretch * stretch, fourth = square * square;
      out.f[i] += theta[0] * fourth * stretch;
      out.f_u[i] += 5.0 * theta[0] * fourth;
      out.f_theta[0][i] = fourth * stretch;
    }
    return true;
  }
};

}  // namespace

const Effect& quintic_stiffness() {
  static const QuinticStiffness effect;
  return effect;
}

}  // namespace shaker::estimator
