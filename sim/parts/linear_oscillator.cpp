// The linear oscillator's damping and stiffness: theta1 v + theta2 u.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct LinearOscillator final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"theta1", "1/s", 2.0, 0.0, 1e6, "damping"},
      {"theta2", "1/s^2", 100.0, 1e-6, 1e9, "stiffness"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    return std::make_unique<LinearOscillator>(values);
  }

  double theta1, theta2;

  explicit LinearOscillator(const Values& values)
      : theta1(values.at("theta1")), theta2(values.at("theta2")) {}

  void add(const Motion& m, Balance& sum) const override {
    sum.force += theta1 * m.v + theta2 * m.u;
  }
};

}  // namespace

const PartEntry kLinearOscillator = {"linear_oscillator", LinearOscillator::kParameters,
                                     LinearOscillator::make};

}  // namespace shaker::sim
