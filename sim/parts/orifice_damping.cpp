// Orifice damping: theta1 |v| v.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct OrificeDamping final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"theta1", "1/m", 16.6667, 0.0, 1e6, "orifice damping, theta1 |v| v"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    return std::make_unique<OrificeDamping>(values);
  }

  double theta1;

  explicit OrificeDamping(const Values& values) : theta1(values.at("theta1")) {}

  void add(const Motion& m, Balance& sum) const override { sum.force += theta1 * m.speed() * m.v; }
};

}  // namespace

const PartEntry kOrificeDamping = {"orifice_damping", OrificeDamping::kParameters,
                                   OrificeDamping::make};

}  // namespace shaker::sim
