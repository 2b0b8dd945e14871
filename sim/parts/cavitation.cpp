// Cavitation: oil cannot pull, so the magnitude of the orifice force in extension is limited to
// f_cav.
#include <algorithm>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct Cavitation final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"cavitation_force", "m/s^2", 0.0, 0.0, 1e3,
       "f_cav, at which the force in extension is cut off; 0: never"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("cavitation_force") == 0.0) return nullptr;
    return std::make_unique<Cavitation>(values);
  }

  double theta1, limit;

  explicit Cavitation(const Values& values)
      : theta1(values.at("theta1") * values.at("rebound_factor")),
        limit(values.at("cavitation_force")) {}

  void add(const Motion& m, Balance& sum) const override {
    if (m.direction >= 0.0) return;
    sum.force += std::max(theta1 * m.v * m.v - limit, 0.0);
  }
};

}  // namespace

const PartEntry kCavitation = {"cavitation", Cavitation::kParameters, Cavitation::make};

}  // namespace shaker::sim
