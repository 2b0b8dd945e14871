// y = u + L (n2 xi^2 + n3 xi^3), xi = u / L: the displacement sensor is nonlinear over its span
// L.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SensorNonlinearity final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"n2", "-", 0.0, -0.5, 0.5, "quadratic deviation at the span, over the span", 0.0},
      {"n3", "-", 0.0, -0.5, 0.5, "cubic deviation at the span, over the span", 0.0},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"L", "m", 0.1, "span of the sensor", true, true},
  };

  std::string_view name() const override { return "sensor_nonlinearity"; }
  std::string_view formula() const override { return "y = u + L (n2 xi^2 + n3 xi^3), xi = u / L"; }
  std::string_view meaning() const override { return "the displacement sensor is not straight"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  void observe(const Signal& at, const double* theta, const double* constants,
               const Seen& out) const override {
    for (int i = 0; i < at.n; ++i) {
      const double span = constants[0];
      const double xi = at.y[i] / span;
      out.y[i] = at.y[i] + span * xi * xi * (theta[0] + theta[1] * xi);
      out.y_y[i] = 1.0 + xi * (2.0 * theta[0] + 3.0 * theta[1] * xi);
      out.y_theta[0][i] = span * xi * xi;
      out.y_theta[1][i] = span * xi * xi * xi;
    }
  }
};

}  // namespace

const Effect& sensor_nonlinearity() {
  static const SensorNonlinearity effect;
  return effect;
}

}  // namespace shaker::estimator
