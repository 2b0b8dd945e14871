// Friction that yields elastically before it slides (Dahl): f_c z / z0, z' = v - |v| z / z0.
// Source: P. R. Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1, 1968.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct PreslidingFriction final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"presliding_friction", "m/s^2", 0.0, 0.0, 100.0,
       "f_c, reached after the presliding distance"},
      {"presliding_distance", "m", 1e-3, 1e-6, 0.1, "z0, over which the friction builds up"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory& memory) {
    if (values.at("presliding_friction") == 0.0) return nullptr;
    return std::make_unique<PreslidingFriction>(values, memory);
  }

  double level, distance;
  std::size_t slot;

  PreslidingFriction(const Values& values, Memory& memory)
      : level(values.at("presliding_friction")),
        distance(values.at("presliding_distance")),
        slot(static_cast<std::size_t>(memory.claim(0.0))) {}

  void add(const Motion& m, Balance& sum) const override {
    sum.force += level * m.state[slot] / distance;
  }
  void remember(const Motion& m, State& rate) const override {
    rate[slot] = m.v - m.speed() * m.state[slot] / distance;
  }
};

}  // namespace

const PartEntry kPreslidingFriction = {"presliding_friction", PreslidingFriction::kParameters,
                                       PreslidingFriction::make};

}  // namespace shaker::sim
