// A second gas chamber opens above the stroke u_k. Above it the gas column shortens only s
// times as fast as the stroke grows, so the gas spring becomes softer.
#include <cmath>

#include "sim/parts/gas_column.hpp"
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct SecondChamber final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"second_chamber_knee", "m", 0.0, 0.0, 1.0, "u_k, where the second chamber opens; 0: never"},
      {"second_chamber_share", "1", 0.5, 0.0, 1.0,
       "s, share of the stroke beyond that compresses"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("second_chamber_knee") == 0.0) return nullptr;
    return std::make_unique<SecondChamber>(values);
  }

  double theta2, theta3, theta4, knee, share;

  explicit SecondChamber(const Values& values)
      : theta2(values.at("theta2")),
        theta3(values.at("theta3")),
        theta4(values.at("theta4")),
        knee(values.at("second_chamber_knee")),
        share(values.at("second_chamber_share")) {}

  double pressure(double u) const { return theta2 * std::pow(gas_column(theta3, u), -theta4); }
  void add(const Motion& m, Balance& sum) const override {
    if (m.u <= knee) return;
    const double softer = pressure(knee + share * (m.u - knee)) - pressure(m.u);
    sum.gas += softer;
    sum.force += softer;
  }
};

}  // namespace

const PartEntry kSecondChamber = {"second_chamber", SecondChamber::kParameters,
                                  SecondChamber::make};

}  // namespace shaker::sim
