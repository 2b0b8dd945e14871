// A damper that changes with time: oil that warms with the work that it absorbs, so that the
// orifice damping falls; and gas that leaks, so that its pressure falls.
#include <cmath>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

// Damping theta1 exp(-warming E), where E is the energy per unit mass absorbed so far.
struct WarmingOil final : PlantPart {
  double theta1, warming;
  std::size_t slot;

  WarmingOil(const Values& values, Memory& memory)
      : theta1(values.at("theta1")),
        warming(values.at("oil_warming")),
        slot(static_cast<std::size_t>(memory.claim(0.0))) {}
  void add(const Motion& m, Balance& sum) const override {
    const double lost = -std::expm1(-warming * m.state[slot]);
    sum.force -= lost * theta1 * m.speed() * m.v;
  }
  void remember(const Motion& m, State& rate) const override {
    rate[slot] = theta1 * m.speed() * m.v * m.v;
  }
};

constexpr Parameter kWarming[] = {
    {"oil_warming", "s^2/m^2", 0.0, 0.0, 100.0, "share of the damping lost per work over mass"}};

std::unique_ptr<PlantPart> make_warming(const Values& values, Memory& memory) {
  if (values.at("oil_warming") == 0.0) return nullptr;
  return std::make_unique<WarmingOil>(values, memory);
}

// Pressure theta2 exp(-leak t), where t is the time since the leak opened.
struct LeakingGas final : PlantPart {
  double theta2, theta3, theta4, leak, opens;
  std::size_t slot;

  LeakingGas(const Values& values, Memory& memory)
      : theta2(values.at("theta2")),
        theta3(values.at("theta3")),
        theta4(values.at("theta4")),
        leak(values.at("gas_leak")),
        opens(values.at("leak_opens")),
        slot(static_cast<std::size_t>(memory.claim(0.0))) {}
  void add(const Motion& m, Balance& sum) const override {
    const double lost = -std::expm1(-leak * std::fmax(0.0, m.state[slot] - opens));
    const double force = lost * theta2 * std::pow(1.0 - theta3 * m.u, -theta4);
    sum.force -= force;
    sum.gas -= force;
  }
  void remember(const Motion&, State& rate) const override { rate[slot] = 1.0; }
};

constexpr Parameter kLeak[] = {
    {"gas_leak", "1/s", 0.0, 0.0, 1.0, "share of the pressure lost in a second"},
    {"leak_opens", "s", 0.0, 0.0, 1e6, "since the rig was switched on"}};

std::unique_ptr<PlantPart> make_leak(const Values& values, Memory& memory) {
  if (values.at("gas_leak") == 0.0) return nullptr;
  return std::make_unique<LeakingGas>(values, memory);
}

}  // namespace

const PartEntry kWarmingOil = {"warming_oil", kWarming, make_warming};
const PartEntry kLeakingGas = {"leaking_gas", kLeak, make_leak};

}  // namespace shaker::sim
