// c v: laminar damping, per unit mass; (6.2).
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class ViscousDamping final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"c", "1/s", 1.0, 0.0, 1e6, "viscous damping over mass", 0.0}};

  std::string_view name() const override { return "viscous_damping"; }
  std::string_view formula() const override { return "c v"; }
  std::string_view meaning() const override {
    return "laminar flow, damping in proportion to the velocity";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool evaluate(const Points& at, const double* theta, const double*,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      out.f[i] += theta[0] * at.v[i];
      out.f_v[i] += theta[0];
      out.f_theta[0][i] = at.v[i];
    }
    return true;
  }
};

}  // namespace

const Effect& viscous_damping() {
  static const ViscousDamping effect;
  return effect;
}

}  // namespace shaker::estimator
