// The gas column. Without heat transfer it is a polytrope, P = theta2 (1 - theta3 u)^-theta4.
// With heat transfer it is an ideal gas of temperature T (relative to the oil's), which
// exchanges heat with the oil with the time constant tau:
//
//     P = theta2 T / (1 - theta3 u),   T' = (1 - T)/tau + (gamma - 1) T theta3 v / (1 - theta3 u)
//
// Slow motion then gives the isotherm, fast motion the adiabat of exponent gamma.
#include <cmath>

#include "sim/parts/gas_column.hpp"
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct Polytrope final : PlantPart {
  double theta2, theta3, theta4;

  explicit Polytrope(const Values& values)
      : theta2(values.at("theta2")), theta3(values.at("theta3")), theta4(values.at("theta4")) {}

  void add(const Motion& m, Balance& sum) const override {
    const double column = gas_column(theta3, m.u);
    // The default is the isotherm; pow() would take a third of the whole run time.
    sum.gas = theta4 == 1.0 ? theta2 / column : theta2 * std::pow(column, -theta4);
    sum.force += sum.gas;
  }
};

struct HeatedGas final : PlantPart {
  double theta2, theta3, tau, gamma;
  std::size_t slot;

  HeatedGas(const Values& values, Memory& memory)
      : theta2(values.at("theta2")),
        theta3(values.at("theta3")),
        tau(values.at("gas_heat_tau")),
        gamma(values.at("gas_gamma")),
        slot(static_cast<std::size_t>(memory.claim(1.0))) {}

  void add(const Motion& m, Balance& sum) const override {
    sum.gas = theta2 * m.state[slot] / gas_column(theta3, m.u);
    sum.force += sum.gas;
  }
  void remember(const Motion& m, State& rate) const override {
    const double temperature = m.state[slot];
    rate[slot] = (1.0 - temperature) / tau +
                 (gamma - 1.0) * temperature * theta3 * m.v / gas_column(theta3, m.u);
  }
};

struct GasSpring {
  static constexpr Parameter kParameters[] = {
      {"theta2", "m/s^2", 1.524, 1e-6, 1e6, "gas force at zero stroke, p0 A / M"},
      {"theta3", "1/m", 5.31496, 1e-6, 1e3, "compactness of the gas column, A / V0"},
      {"theta4", "1", 1.0, 0.1, 5.0, "polytropic index (without heat transfer)"},
      {"gas_heat_tau", "s", 0.0, 0.0, 1e6, "time of heat exchange; 0: polytrope of index theta4"},
      {"gas_gamma", "1", 1.4, 1.0, 2.0, "ratio of specific heats (with heat transfer)"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory& memory) {
    if (values.at("gas_heat_tau") > 0.0) return std::make_unique<HeatedGas>(values, memory);
    return std::make_unique<Polytrope>(values);
  }
};

}  // namespace

const PartEntry kGasSpring = {"gas_spring", GasSpring::kParameters, GasSpring::make};

}  // namespace shaker::sim
