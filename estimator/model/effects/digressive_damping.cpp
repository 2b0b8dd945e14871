// c_d v / sqrt(1 + (v / v_k)^2): damping that gives way above a velocity, per unit mass: valves that
// blow off. With a v_k far below the largest velocity this is dry friction that reverses gently
// (Coulomb's, as the catalogue rounds it); the range of v_k keeps the two apart.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class DigressiveDamping final : public DualEffect<DigressiveDamping, kSeesV, 2> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"c_d", "1/s", 1.0, 0.0, 1e6, "damping over mass at low velocity", 0.0},
      {"v_k", "m/s", 0.4, 0.25, 1.0, "velocity above which the damping gives way"},
  };

  std::string_view name() const override { return "digressive_damping"; }
  std::string_view formula() const override { return "c_d v / sqrt(1 + (v / v_k)^2)"; }
  std::string_view meaning() const override {
    return "damping that gives way at high velocity (valves that blow off)";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double*, T& f, T*) {
    f = theta[0] * theta[1] * at.v / smooth_root(at.v, theta[1]);
    return true;
  }

 private:
  template <class T>
  static T smooth_root(const T& v, const T& knee) {
    using std::sqrt;
    return sqrt(square(v) + square(knee));
  }
};

}  // namespace

const Effect& digressive_damping() {
  static const DigressiveDamping effect;
  return effect;
}

}  // namespace shaker::estimator
