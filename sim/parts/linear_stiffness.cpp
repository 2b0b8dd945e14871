// A spring beside the damper: k (u - u0).
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct LinearStiffness final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"linear_stiffness", "1/s^2", 0.0, 0.0, 1e6, "k in k (u - u0)"},
      {"linear_stiffness_centre", "m", 0.0, -1.0, 1.0, "u0"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("linear_stiffness") == 0.0) return nullptr;
    return std::make_unique<LinearStiffness>(values);
  }

  double k, centre;

  explicit LinearStiffness(const Values& values)
      : k(values.at("linear_stiffness")), centre(values.at("linear_stiffness_centre")) {}

  void add(const Motion& m, Balance& sum) const override { sum.force += k * (m.u - centre); }
};

}  // namespace

const PartEntry kLinearStiffness = {"linear_stiffness", LinearStiffness::kParameters,
                                    LinearStiffness::make};

}  // namespace shaker::sim
