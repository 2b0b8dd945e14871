// The weight of the mass that the damper carries.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct Gravity final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"gravity", "m/s^2", 9.80665, 0.0, 100.0, "weight per unit mass"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    return std::make_unique<Gravity>(values);
  }

  double g;

  explicit Gravity(const Values& values) : g(values.at("gravity")) {}

  void add(const Motion&, Balance& sum) const override { sum.force -= g; }
};

}  // namespace

const PartEntry kGravity = {"gravity", Gravity::kParameters, Gravity::make};

}  // namespace shaker::sim
