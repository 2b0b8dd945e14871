// A metering pin narrows the orifice with the stroke. The part adds theta1 |v| v [(1 - k1 xi -
// k2 xi^2)^-2 - 1], where xi = u / metering_stroke.
#include <algorithm>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct MeteringPin final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"metering_k1", "1", 0.0, 0.0, 0.8, "k1 of the pin"},
      {"metering_k2", "1", 0.0, 0.0, 0.8, "k2 of the pin"},
      {"metering_stroke", "m", 0.19, 0.001, 10.0, "stroke to which xi is referred"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("metering_k1") == 0.0 && values.at("metering_k2") == 0.0) return nullptr;
    return std::make_unique<MeteringPin>(values);
  }

  double theta1, k1, k2, stroke;

  explicit MeteringPin(const Values& values)
      : theta1(values.at("theta1")),
        k1(values.at("metering_k1")),
        k2(values.at("metering_k2")),
        stroke(values.at("metering_stroke")) {}

  void add(const Motion& m, Balance& sum) const override {
    const double xi = m.u / stroke;
    const double area = std::max(1.0 - k1 * xi - k2 * xi * xi, 0.05);
    sum.force += theta1 * m.speed() * m.v * (1.0 / (area * area) - 1.0);
  }
};

}  // namespace

const PartEntry kMeteringPin = {"metering_pin", MeteringPin::kParameters, MeteringPin::make};

}  // namespace shaker::sim
