// Laminar flow at low speed: below the speed v_c the orifice's force becomes linear in v. The
// force theta1 v sqrt((v^2 + sqrt(v^4 + 4 v_c^4)) / 2) replaces theta1 |v| v.
#include <cmath>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct LaminarOrifice final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"laminar_speed", "m/s", 0.0, 0.0, 10.0, "v_c, below which the orifice flow is laminar"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("laminar_speed") == 0.0) return nullptr;
    return std::make_unique<LaminarOrifice>(values);
  }

  double theta1, v4;

  explicit LaminarOrifice(const Values& values)
      : theta1(values.at("theta1")), v4(4.0 * std::pow(values.at("laminar_speed"), 4)) {}

  void add(const Motion& m, Balance& sum) const override {
    const double v2 = m.v * m.v;
    const double effective = std::sqrt(0.5 * (v2 + std::sqrt(v2 * v2 + v4)));
    sum.force += theta1 * m.v * (effective - m.speed());
  }
};

}  // namespace

const PartEntry kLaminarOrifice = {"laminar_orifice", LaminarOrifice::kParameters,
                                   LaminarOrifice::make};

}  // namespace shaker::sim
