// Dry friction with an optional static peak (Stribeck): f_c [1 + (ratio - 1) exp(-(v/v_s)^2)],
// against the motion. The damper sticks below the break-away level.
#include <cmath>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct CoulombFriction final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"coulomb_friction", "m/s^2", 0.0, 0.0, 100.0, "dry friction f_c per unit mass"},
      {"stribeck_ratio", "1", 1.0, 1.0, 5.0, "static over sliding friction"},
      {"stribeck_speed", "m/s", 0.01, 1e-5, 10.0, "speed v_s at which the static peak has gone"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("coulomb_friction") == 0.0) return nullptr;
    return std::make_unique<CoulombFriction>(values);
  }

  double level, peak, v_s;

  explicit CoulombFriction(const Values& values)
      : level(values.at("coulomb_friction")),
        peak(level * (values.at("stribeck_ratio") - 1.0)),
        v_s(values.at("stribeck_speed")) {}

  void add(const Motion& m, Balance& sum) const override {
    sum.friction += level;
    if (peak > 0.0) sum.friction += peak * std::exp(-(m.v / v_s) * (m.v / v_s));
  }
};

}  // namespace

const PartEntry kCoulombFriction = {"coulomb_friction", CoulombFriction::kParameters,
                                    CoulombFriction::make};

}  // namespace shaker::sim
