// Friction of seals that the gas presses on: dry friction mu P. In a plant's list this part
// must follow the parts that change the gas pressure.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct PressureFriction final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"pressure_friction", "1", 0.0, 0.0, 1.0, "mu in mu P"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("pressure_friction") == 0.0) return nullptr;
    return std::make_unique<PressureFriction>(values);
  }

  double mu;

  explicit PressureFriction(const Values& values) : mu(values.at("pressure_friction")) {}

  void add(const Motion&, Balance& sum) const override { sum.friction += mu * sum.gas; }
};

}  // namespace

const PartEntry kPressureFriction = {"pressure_friction", PressureFriction::kParameters,
                                     PressureFriction::make};

}  // namespace shaker::sim
