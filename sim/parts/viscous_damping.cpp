// Viscous damping: c v.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct ViscousDamping final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"viscous_damping", "1/s", 0.0, 0.0, 1e4, "c in c v"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("viscous_damping") == 0.0) return nullptr;
    return std::make_unique<ViscousDamping>(values);
  }

  double c;

  explicit ViscousDamping(const Values& values) : c(values.at("viscous_damping")) {}

  void add(const Motion& m, Balance& sum) const override { sum.force += c * m.v; }
};

}  // namespace

const PartEntry kViscousDamping = {"viscous_damping", ViscousDamping::kParameters,
                                   ViscousDamping::make};

}  // namespace shaker::sim
