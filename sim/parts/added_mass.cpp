// Added mass: oil that is accelerated together with the stroke, m_a u''.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct AddedMass final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"added_mass", "1", 0.0, 0.0, 10.0, "m_a over the mass on the damper"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("added_mass") == 0.0) return nullptr;
    return std::make_unique<AddedMass>(values);
  }

  double share;

  explicit AddedMass(const Values& values) : share(values.at("added_mass")) {}
  void add(const Motion&, Balance& sum) const override { sum.mass += share; }
};

}  // namespace

const PartEntry kAddedMass = {"added_mass", AddedMass::kParameters, AddedMass::make};

}  // namespace shaker::sim
