// k (u - u0): a linear spring, per unit mass; (6.2).
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class LinearStiffness final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k", "1/s^2", 10.0, 0.0, 1e8, "stiffness over mass", 0.0}};
  static constexpr ConstantInfo kConstants[] = {
      {"u0", "m", 0.0, "stroke at which the spring is at rest"}};

  std::string_view name() const override { return "linear_stiffness"; }
  std::string_view formula() const override { return "k (u - u0)"; }
  std::string_view meaning() const override { return "a spring beside the damper"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      const double stretch = at.u[i] - constants[0];
      out.f[i] += theta[0] * stretch;
      out.f_u[i] += theta[0];
      out.f_theta[0][i] = stretch;
    }
    return true;
  }
};

}  // namespace

const Effect& linear_stiffness() {
  static const LinearStiffness effect;
  return effect;
}

}  // namespace shaker::estimator
