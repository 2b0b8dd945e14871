// The Bouc-Wen hysteresis k z, z' = v - b |v|_e |z|^(n-1) z - c v |z|^n, in the three numbers that
// can be told apart: with s = z / z0 in -1 .. 1, z0 = (b + c)^(-1/n), f_h = k z0 and beta = b / (b
// + c),
//     f_h s,     z0 s' = v - |s|^(n-1) (beta |v|_e s + (1 - beta) v |s|)
// |s| is rounded at 0 over the width r. Y. K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249-263.
#include "estimator/effects/catalogue.hpp"
#include "estimator/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

constexpr ParameterInfo kParameters[] = {
    {"f_h", "m/s^2", 0.3, 0.0, 100.0, "yield force per unit mass, k z0", 0.0},
    {"z0", "m", 2e-3, 5e-5, 0.1, "yield displacement, (b + c)^(-1/n)"},
    {"beta", "-", 0.65, 0.0, 2.0, "b / (b + c): fat loop 1, lean 0.5"},
    {"n", "-", 1.3, 1.0, 2.0, "sharpness of the knee"},
};
constexpr ConstantInfo kConstants[] = {
    {"e", "m/s", 1e-3, "rounding of |v| about v = 0", true},
    {"r", "-", 0.02, "rounding of |s| about s = 0", true},
};
constexpr InternalInfo kInternals[] = {
    {"s", "-", 1, 0.0, "hysteretic displacement over z0"},
};

class BoucWenHysteresis final
    : public DualEffect<BoucWenHysteresis, kSeesV | kSeesW | kSeesWDot, 4, 1> {
 public:
  std::string_view name() const override { return "bouc_wen_hysteresis"; }
  std::string_view formula() const override {
    return "f_h s,  z0 s' = v - |s|^(n-1) (beta |v|_e s + (1 - beta) v |s|)";
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
    const T loop = theta[2] * smooth_abs(at.v, constants[0]) * at.w[0];
    f = theta[0] * at.w[0];
    h[0] = theta[1] * at.w_dot[0] - at.v + power * (loop + (1.0 - theta[2]) * at.v * size);
    return true;
  }
};

}  // namespace

const Effect& bouc_wen_hysteresis() {
  static const BoucWenHysteresis effect;
  return effect;
}

}  // namespace shaker::estimator
