// The damper stands on a tyre: an unsprung mass m (relative to the mass on the damper) between
// damper and table, with stiffness k_t and damping c_t to the table. w is the tyre's
// compression, F the whole force of the damper per unit mass, g the weight per unit mass:
//
//     u'' + w'' + F - g = x,     m (w'' - g - x) + c_t w' + k_t w - F = 0
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct Tyre final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"tyre_stiffness", "1/s^2", 0.0, 0.0, 1e7, "k_t of the tyre under the damper; 0: no tyre"},
      {"tyre_damping", "1/s", 5.0, 0.0, 1e4, "c_t of the tyre"},
      {"unsprung_mass", "1", 0.05, 1e-3, 10.0, "m between damper and tyre"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory& memory) {
    if (values.at("tyre_stiffness") == 0.0) return nullptr;
    return std::make_unique<Tyre>(values, memory);
  }

  double stiffness, damping, mass, gravity;
  std::size_t w, speed;

  Tyre(const Values& values, Memory& memory)
      : stiffness(values.at("tyre_stiffness")),
        damping(values.at("tyre_damping")),
        mass(values.at("unsprung_mass")),
        gravity(values.at("gravity")),
        w(static_cast<std::size_t>(memory.claim((1.0 + mass) * gravity / stiffness))),
        speed(static_cast<std::size_t>(memory.claim(0.0))) {}

  void add(const Motion&, Balance&) const override {}
  double support(const Motion& m, double force, double x, State& rate) const override {
    const double damper = force + gravity;
    const double up = damper - stiffness * m.state[w] - damping * m.state[speed];
    rate[w] = m.state[speed];
    rate[speed] = x + gravity + up / mass;
    return rate[speed];
  }
};

}  // namespace

const PartEntry kTyre = {"tyre", Tyre::kParameters, Tyre::make};

}  // namespace shaker::sim
