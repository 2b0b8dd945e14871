// k2 (u - u0)^2: a spring that stiffens to one side and softens to the other, per unit mass: magnets
// beside the moving mass, a beam that is bent or loaded from one side.
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class QuadraticStiffness final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k2", "1/(m s^2)", 1.0, -1e10, 1e10, "quadratic stiffness over mass", 0.0}};
  static constexpr ConstantInfo kConstants[] = {
      {"u0", "m", 0.0, "stroke at which the force vanishes"}};

  std::string_view name() const override { return "quadratic_stiffness"; }
  std::string_view formula() const override { return "k2 (u - u0)^2"; }
  std::string_view meaning() const override {
    return "a spring that stiffens to one side of its centre";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      const double stretch = at.u[i] - constants[0];
      out.f[i] += theta[0] * stretch * stretch;
      out.f_u[i] += 2.0 * theta[0] * stretch;
      out.f_theta[0][i] = stretch * stretch;
    }
    return true;
  }
};

}  // namespace

const Effect& quadratic_stiffness() {
  static const QuadraticStiffness effect;
  return effect;
}

}  // namespace shaker::estimator
