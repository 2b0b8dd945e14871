// A spring that stiffens away from its centre: k3 (u - u0)^3.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct CubicStiffness final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"cubic_stiffness", "1/(m^2 s^2)", 0.0, 0.0, 1e8, "k3 in k3 (u - u0)^3"},
      {"cubic_stiffness_centre", "m", 0.0, -1.0, 1.0, "u0"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("cubic_stiffness") == 0.0) return nullptr;
    return std::make_unique<CubicStiffness>(values);
  }

  double k3, centre;

  explicit CubicStiffness(const Values& values)
      : k3(values.at("cubic_stiffness")), centre(values.at("cubic_stiffness_centre")) {}

  void add(const Motion& m, Balance& sum) const override {
    const double away = m.u - centre;
    sum.force += k3 * away * away * away;
  }
};

}  // namespace

const PartEntry kCubicStiffness = {"cubic_stiffness", CubicStiffness::kParameters,
                                   CubicStiffness::make};

}  // namespace shaker::sim
