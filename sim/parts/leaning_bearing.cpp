// A bearing whose normal force grows with the distance of the stroke from u0: dry friction s |u
// - u0|. It is absent from the estimator's catalogue on purpose.
#include <cmath>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct LeaningBearing final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"leaning_friction", "1/s^2", 0.0, 0.0, 1e4, "s in the dry friction s |u - u0|"},
      {"leaning_middle", "m", 0.16, -1.0, 1.0, "u0"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("leaning_friction") == 0.0) return nullptr;
    return std::make_unique<LeaningBearing>(values);
  }

  double slope, middle;

  explicit LeaningBearing(const Values& values)
      : slope(values.at("leaning_friction")), middle(values.at("leaning_middle")) {}
  void add(const Motion& m, Balance& sum) const override {
    sum.friction += slope * std::abs(m.u - middle);
  }
};

}  // namespace

const PartEntry kLeaningBearing = {"leaning_bearing", LeaningBearing::kParameters,
                                   LeaningBearing::make};

}  // namespace shaker::sim
