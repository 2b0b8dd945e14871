// k3 (u - u0)^3: a spring that hardens (k3 > 0) or softens, per unit mass. With
// linear_stiffness and viscous_damping it makes the Duffing oscillator.
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class CubicStiffness final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k3", "1/(m^2 s^2)", 1.0, -1e12, 1e12, "cubic stiffness over mass", 0.0}};
  static constexpr ConstantInfo kConstants[] = {
      {"u0", "m", 0.0, "stroke at which the force vanishes"}};

  std::string_view name() const override { return "cubic_stiffness"; }
  std::string_view formula() const override { return "k3 (u - u0)^3"; }
  std::string_view meaning() const override {
    return "a spring that stiffens away from its centre";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      const double stretch = at.u[i] - constants[0];
      const double square = stretch * stretch;
      out.f[i] += theta[0] * square * stretch;
      out.f_u[i] += 3.0 * theta[0] * square;
      out.f_theta[0][i] = square * stretch;
    }
    return true;
  }
};

}  // namespace

const Effect& cubic_stiffness() {
  static const CubicStiffness effect;
  return effect;
}

}  // namespace shaker::estimator
