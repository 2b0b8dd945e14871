// Springs of one power of the stretch, per unit mass: k (u - u0), k2 (u - u0)^2 and so on. With
// cubic_stiffness and viscous_damping the linear one makes the Duffing oscillator. The quadratic one
// stiffens to one side and softens to the other: magnets beside the moving mass, a beam that is loaded
// from one side. The weight of a pendulum, g sin(u), has all odd ones.
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

struct SpringWords {
  std::string_view name, formula, meaning;
};

template <int kPower>
class Spring final : public Effect {
 public:
  Spring(const SpringWords& words, const ParameterInfo& stiffness)
      : words_(words), stiffness_{stiffness} {}

  std::string_view name() const override { return words_.name; }
  std::string_view formula() const override { return words_.formula; }
  std::string_view meaning() const override { return words_.meaning; }
  std::span<const ParameterInfo> parameters() const override { return stiffness_; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      const double stretch = at.u[i] - constants[0];
      double below = 1.0;  // the power below
      for (int k = 1; k < kPower; ++k)
        below *= stretch;
      out.f[i] += theta[0] * below * stretch;
      out.f_u[i] += kPower * theta[0] * below;
      out.f_theta[0][i] = below * stretch;
    }
    return true;
  }

 private:
  static constexpr ConstantInfo kConstants[] = {
      {"u0", "m", 0.0, "stroke at which the force vanishes"}};
  SpringWords words_;
  ParameterInfo stiffness_[1];
};

}  // namespace

const Effect& linear_stiffness() {
  static const Spring<1> effect({"linear_stiffness", "k (u - u0)", "a spring beside the damper"},
                                {"k", "1/s^2", 10.0, 0.0, 1e8, "stiffness over mass", 0.0});
  return effect;
}

const Effect& quadratic_stiffness() {
  static const Spring<2> effect(
      {"quadratic_stiffness", "k2 (u - u0)^2", "a spring that stiffens to one side of its centre"},
      {"k2", "1/(m s^2)", 1.0, -1e10, 1e10, "quadratic stiffness over mass", 0.0});
  return effect;
}

const Effect& cubic_stiffness() {
  static const Spring<3> effect(
      {"cubic_stiffness", "k3 (u - u0)^3", "a spring that stiffens away from its centre"},
      {"k3", "1/(m^2 s^2)", 1.0, -1e12, 1e12, "cubic stiffness over mass", 0.0});
  return effect;
}

const Effect& quintic_stiffness() {
  static const Spring<5> effect(
      {"quintic_stiffness", "k5 (u - u0)^5", "a spring that stiffens far from its centre"},
      {"k5", "1/(m^4 s^2)", 1.0, -1e16, 1e16, "quintic stiffness over mass", 0.0});
  return effect;
}

}  // namespace shaker::estimator
