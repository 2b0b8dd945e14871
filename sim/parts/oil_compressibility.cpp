// Compressible oil: the orifice acts in series with an oil spring, F' = k_o (v - q), where q is
// the speed at which the orifice passes the oil under the force F. F replaces theta1 |v| v.
//
// F = theta1 (|q| + q_l) q: the orifice is laminar below q_l, as a real one is, so that the
// oil's relaxation stays finite where F passes through zero.
#include <cmath>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct OilCompressibility final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"oil_stiffness", "1/s^2", 0.0, 0.0, 1e6,
       "k_o of the oil in series with the orifice; 0: rigid"},
      {"oil_laminar_speed", "m/s", 5e-3, 1e-5, 1.0, "q_l, below which the oil's flow is laminar"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory& memory) {
    if (values.at("oil_stiffness") == 0.0) return nullptr;
    return std::make_unique<OilCompressibility>(values, memory);
  }

  double theta1, stiffness, laminar;
  std::size_t slot;

  OilCompressibility(const Values& values, Memory& memory)
      : theta1(values.at("theta1")),
        stiffness(values.at("oil_stiffness")),
        laminar(values.at("oil_laminar_speed")),
        slot(static_cast<std::size_t>(memory.claim(0.0))) {}

  double passing(double force) const {
    const double root = std::sqrt(0.25 * laminar * laminar + std::abs(force) / theta1);
    return std::copysign(root - 0.5 * laminar, force);
  }
  void add(const Motion& m, Balance& sum) const override {
    sum.force += m.state[slot] - theta1 * m.speed() * m.v;
  }
  void remember(const Motion& m, State& rate) const override {
    rate[slot] = stiffness * (m.v - passing(m.state[slot]));
  }
};

}  // namespace

const PartEntry kOilCompressibility = {"oil_compressibility", OilCompressibility::kParameters,
                                       OilCompressibility::make};

}  // namespace shaker::sim
