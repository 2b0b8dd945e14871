// The Bouc-Wen hysteresis k z, z' = v - b |v|_e |z|^(n-1) z - c v |z|^n, in identifiable
// parameters: with s = z / z0, z0 = b^(-1/n), f_h = k z0 and gamma = c / b,
//     f_h s,     z0 s' = v - |s|^(n-1) (|v|_e s + gamma v |s|)
// b > 0, so that every loop dissipates energy. Along a stroke ds/du is 1 - (1 + gamma) |s|^n on
// loading and 1 + (1 - gamma) |s|^n on unloading. For gamma above -1 the loop softens, and |s|
// tends to (1 + gamma)^(-1/n), which is 1 for Dahl's friction (gamma = 0). For gamma below -1
// it hardens. With n = 1, |s| then stays under (exp(-(1 + gamma) u / z0) - 1) / -(1 + gamma)
// over a stroke of length u, because unloading is always steeper than loading. |s| is smoothed
// at 0 with the width r. Y. K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249-263. The benchmark
// of J. P. Noel and M. Schoukens has gamma = -1.375.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class BoucWenHysteresis final
    : public DualEffect<BoucWenHysteresis, kSeesV | kSeesW | kSeesWDot, 4, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"f_h", "m/s^2", 0.3, 0.0, 100.0, "force per unit mass at s = 1, k z0", 0.0},
      {"z0", "m", 2e-3, 5e-5, 0.1, "displacement over which it yields, b^(-1/n)"},
      {"gamma", "-", 0.5, -3.0, 5.0, "c / b: lean loop 1, fat 0, hardening below -1"},
      {"n", "-", 1.3, 1.0, 2.0, "sharpness of the knee"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"e", "m/s", 1e-3, "rounding of |v| about v = 0", true},
      {"r", "-", 0.02, "rounding of |s| about s = 0", true},
  };
  static constexpr InternalInfo kInternals[] = {
      {"s", "-", 1, 0.0, "hysteretic displacement over z0"},
  };

  std::string_view name() const override { return "bouc_wen_hysteresis"; }
  std::string_view formula() const override {
    return "f_h s,  z0 s' = v - |s|^(n-1) (|v|_e s + gamma v |s|)";
  }
  std::string_view meaning() const override {
    return "a force that depends on the history of the motion";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  std::span<const InternalInfo> internals() const override { return kInternals; }

  template <class T>
  static bool formula(const Local<T, 1>& at, const T* theta, const double* constants, T& f, T* h) {
    const T size = smooth_abs(at.w[0], constants[1]);
    const T power = exp((theta[3] - 1.0) * log(size));
    const T loop = smooth_abs(at.v, constants[0]) * at.w[0];
    f = theta[0] * at.w[0];
    h[0] = theta[1] * at.w_dot[0] - at.v + power * (loop + theta[2] * at.v * size);
    return true;
  }
};

}  // namespace

const Effect& bouc_wen_hysteresis() {
  static const BoucWenHysteresis effect;
  return effect;
}

}  // namespace shaker::estimator
