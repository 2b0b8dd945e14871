// y = G u: the scale of the displacement sensor is wrong.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SensorGain final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"G", "-", 1.0, 0.9, 1.1, "shown over true displacement", 1.0},
  };

  std::string_view name() const override { return "sensor_gain"; }
  std::string_view formula() const override { return "y = G u"; }
  std::string_view meaning() const override { return "the displacement sensor's scale is off"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  void observe(const Signal& at, const double* theta, const double*,
               const Seen& out) const override {
    for (int i = 0; i < at.n; ++i) {
      out.y[i] = theta[0] * at.y[i];
      out.y_y[i] = theta[0];
      out.y_theta[0][i] = at.y[i];
    }
  }
};

}  // namespace

const Effect& sensor_gain() {
  static const SensorGain effect;
  return effect;
}

}  // namespace shaker::estimator
