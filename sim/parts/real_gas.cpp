// A real gas: its pressure is multiplied by 1 + B (rho - 1), where rho = 1 / (1 - theta3 u) is
// its density relative to full extension. B is a second virial coefficient; a negative B also
// describes gas that dissolves in the oil under pressure.
#include "sim/parts/gas_column.hpp"
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct RealGas final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"gas_virial", "1", 0.0, -0.1, 0.1, "B of the gas's deviation from an ideal one"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("gas_virial") == 0.0) return nullptr;
    return std::make_unique<RealGas>(values);
  }

  double theta3, virial;

  explicit RealGas(const Values& values)
      : theta3(values.at("theta3")), virial(values.at("gas_virial")) {}

  // Must follow the gas spring in the plant's list, because it multiplies the gas spring's
  // force.
  void add(const Motion& m, Balance& sum) const override {
    const double deviation = sum.gas * virial * (1.0 / gas_column(theta3, m.u) - 1.0);
    sum.gas += deviation;
    sum.force += deviation;
  }
};

}  // namespace

const PartEntry kRealGas = {"real_gas", RealGas::kParameters, RealGas::make};

}  // namespace shaker::sim
