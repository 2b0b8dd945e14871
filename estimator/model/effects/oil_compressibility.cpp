// The orifice in series with an oil spring, instead of theta1 |v| v. d is the compression of the
// spring, q the remaining flow through the orifice:
//     k_o d - theta1 |v| v,     theta1 (|q| + q_l) q = k_o d,     q = v - d'
// Below q_l the flow is laminar. With purely turbulent flow, the oil would relax instantly at
// the zero of the orifice's force.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class OilCompressibility final
    : public DualEffect<OilCompressibility, kSeesV | kSeesW | kSeesWDot, 3, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k_o", "1/s^2", 2e4, 2e2, 1e6, "stiffness of the oil over mass"},
      {"q_l", "m/s", 0.01, 1e-4, 0.1, "speed below which the flow is laminar"},
  };
  static constexpr InternalInfo kInternals[] = {
      {"d", "m", 1, 0.0, "compression of the oil"},
  };
  static constexpr Borrowed kBorrowed[] = {{"orifice_damping", "theta1"}};

  std::string_view name() const override { return "oil_compressibility"; }
  std::string_view formula() const override {
    return "k_o d - theta1 |v| v,  theta1 (|v - d'| + q_l) (v - d') = k_o d";
  }
  std::string_view meaning() const override { return "oil that gives before it flows"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const InternalInfo> internals() const override { return kInternals; }
  std::span<const Borrowed> borrows() const override { return kBorrowed; }

  template <class T>
  static bool formula(const Local<T, 1>& at, const T* theta, const double*, T& f, T* h) {
    const T flow = at.v - at.w_dot[0];
    f = theta[0] * at.w[0] - theta[2] * abs(at.v) * at.v;
    h[0] = theta[0] * at.w[0] - theta[2] * (abs(flow) + theta[1]) * flow;
    return true;
  }
};

}  // namespace

const Effect& oil_compressibility() {
  static const OilCompressibility effect;
  return effect;
}

}  // namespace shaker::estimator
