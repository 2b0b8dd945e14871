// A step in the bore: within a window of the stroke the orifice damping is multiplied by a
// factor. Each edge is a fifth of the window wide. The part is absent from the estimator's
// catalogue on purpose.
#include <cmath>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct NotchDamping final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"notch_factor", "1", 1.0, 0.0, 100.0, "orifice damping inside the notch over that outside"},
      {"notch_centre", "m", 0.16, -1.0, 1.0, "stroke at the notch's middle"},
      {"notch_width", "m", 5e-3, 1e-4, 1.0, "stroke from edge to edge"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("notch_factor") == 1.0) return nullptr;
    return std::make_unique<NotchDamping>(values);
  }

  double theta1, extra, centre, half;

  explicit NotchDamping(const Values& values)
      : theta1(values.at("theta1")),
        extra(values.at("notch_factor") - 1.0),
        centre(values.at("notch_centre")),
        half(0.5 * values.at("notch_width")) {}
  void add(const Motion& m, Balance& sum) const override {
    const double edge = 0.4 * half;
    const double inside =
        0.5 * (std::tanh((m.u - centre + half) / edge) - std::tanh((m.u - centre - half) / edge));
    sum.force += extra * inside * theta1 * m.speed() * m.v;
  }
};

}  // namespace

const PartEntry kNotchDamping = {"notch_damping", NotchDamping::kParameters, NotchDamping::make};

}  // namespace shaker::sim
