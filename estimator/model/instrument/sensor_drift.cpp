// y = u + d t, t from the middle of the record: the zero of the displacement sensor drifts. In a
// period that was not detrended, the drift causes a sawtooth.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SensorDrift final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"d", "m/s", 0.0, -0.01, 0.01, "drift of the zero", 0.0},
  };

  std::string_view name() const override { return "sensor_drift"; }
  std::string_view formula() const override { return "y = u + d t"; }
  std::string_view meaning() const override { return "the displacement sensor's zero drifts"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool sees_time() const override { return true; }
  void observe(const Signal& at, const double* theta, const double*,
               const Seen& out) const override {
    for (int i = 0; i < at.n; ++i) {
      out.y[i] = at.y[i] + theta[0] * at.t[i];
      out.y_y[i] = 1.0;
      out.y_theta[0][i] = at.t[i];
    }
  }
};

}  // namespace

const Effect& sensor_drift() {
  static const SensorDrift effect;
  return effect;
}

}  // namespace shaker::estimator
