// c_u (u - u0) v: damping that grows along the stroke and falls the other way, per unit mass: a laminar
// gap that narrows, a magnet that comes nearer to its disc.
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class StrokeDamping final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"c_u", "1/(m s)", 1.0, -1e8, 1e8, "damping over mass, more for each metre of stroke", 0.0}};
  static constexpr ConstantInfo kConstants[] = {
      {"u0", "m", 0.0, "stroke at which there is none of it"}};

  std::string_view name() const override { return "stroke_damping"; }
  std::string_view formula() const override { return "c_u (u - u0) v"; }
  std::string_view meaning() const override { return "damping that grows along the stroke"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      const double stroke = at.u[i] - constants[0];
      out.f[i] += theta[0] * stroke * at.v[i];
      out.f_u[i] += theta[0] * at.v[i];
      out.f_v[i] += theta[0] * stroke;
      out.f_theta[0][i] = stroke * at.v[i];
    }
    return true;
  }
};

}  // namespace

const Effect& stroke_damping() {
  static const StrokeDamping effect;
  return effect;
}

}  // namespace shaker::estimator
