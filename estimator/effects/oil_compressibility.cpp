// The orifice in series with an oil spring, in place of theta1 |v| v: d is the spring's
// compression,
//     k_o d - theta1 |v| v,     theta1 |v - d'| (v - d') = k_o d
#include "estimator/effects/catalogue.hpp"
#include "estimator/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

constexpr ParameterInfo kParameters[] = {
    {"k_o", "1/s^2", 2e4, 1e3, 1e6, "stiffness of the oil over mass"},
};
constexpr InternalInfo kInternals[] = {
    {"d", "m", 1, 0.0, "compression of the oil"},
};
constexpr Borrowed kBorrowed[] = {{"orifice_damping", "theta1"}};

class OilCompressibility final
    : public DualEffect<OilCompressibility, kSeesV | kSeesW | kSeesWDot, 2, 1> {
 public:
  std::string_view name() const override { return "oil_compressibility"; }
  std::string_view formula() const override {
    return "k_o d - theta1 |v| v,  theta1 |v - d'| (v - d') = k_o d";
  }
  std::string_view meaning() const override { return "oil that gives before it flows"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const InternalInfo> internals() const override { return kInternals; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }

  template <class T>
  static bool formula(const Local<T, 1>& at, const T* theta, const double*, T& f, T* h) {
    const T flow = at.v - at.w_dot[0];
    f = theta[0] * at.w[0] - theta[1] * abs(at.v) * at.v;
    h[0] = theta[0] * at.w[0] - theta[1] * abs(flow) * flow;
    return true;
  }
};

}  // namespace

const Effect& oil_compressibility() {
  static const OilCompressibility effect;
  return effect;
}

}  // namespace shaker::estimator
