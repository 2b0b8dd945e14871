// y = u + b: the zero of the displacement sensor is wrong. theta2 and theta3 of the oleo absorb
// the offset exactly, so that the displacement alone never shows it.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SensorOffset final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"b", "m", 0.0, -0.1, 0.1, "shown at zero displacement", 0.0},
  };

  std::string_view name() const override { return "sensor_offset"; }
  std::string_view formula() const override { return "y = u + b"; }
  std::string_view meaning() const override { return "the displacement sensor's zero is off"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  void observe(const Signal& at, const double* theta, const double*,
               const Seen& out) const override {
    for (int i = 0; i < at.n; ++i) {
      out.y[i] = at.y[i] + theta[0];
      out.y_y[i] = 1.0;
      out.y_theta[0][i] = 1.0;
    }
  }
};

}  // namespace

const Effect& sensor_offset() {
  static const SensorOffset effect;
  return effect;
}

}  // namespace shaker::estimator
