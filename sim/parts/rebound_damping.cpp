// A rebound valve: in extension the orifice damping is multiplied by `rebound_factor`.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct ReboundDamping final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"rebound_factor", "1", 1.0, 0.0, 100.0,
       "orifice damping in extension over that in compression"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("rebound_factor") == 1.0) return nullptr;
    return std::make_unique<ReboundDamping>(values);
  }

  double extra;

  explicit ReboundDamping(const Values& values)
      : extra(values.at("theta1") * (values.at("rebound_factor") - 1.0)) {}

  void add(const Motion& m, Balance& sum) const override {
    if (m.direction < 0.0) sum.force += extra * m.speed() * m.v;
  }
};

}  // namespace

const PartEntry kReboundDamping = {"rebound_damping", ReboundDamping::kParameters,
                                   ReboundDamping::make};

}  // namespace shaker::sim
