// A detent: a force that is periodic in the stroke, f sin(2 pi u / pitch), as of teeth or
// magnets. It is absent from the estimator's catalogue on purpose.
#include <cmath>
#include <numbers>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct Detent final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"detent_force", "m/s^2", 0.0, 0.0, 100.0, "amplitude of a force that waves with the stroke"},
      {"detent_pitch", "m", 0.01, 1e-4, 1.0, "stroke from wave to wave"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("detent_force") == 0.0) return nullptr;
    return std::make_unique<Detent>(values);
  }

  double level, pitch;

  explicit Detent(const Values& values)
      : level(values.at("detent_force")), pitch(values.at("detent_pitch")) {}
  void add(const Motion& m, Balance& sum) const override {
    sum.force += level * std::sin(2.0 * std::numbers::pi * m.u / pitch);
  }
};

}  // namespace

const PartEntry kDetent = {"detent", Detent::kParameters, Detent::make};

}  // namespace shaker::sim
