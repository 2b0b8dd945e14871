// y = u - (q / pi) atan2(r sin(phi), 1 + r cos(phi)), phi = 2 pi u / q: rounding to quantisation
// steps q. The edges of the steps are smoothed; r = 1 gives sharp edges: y = q round(u / q).
#include <cmath>
#include <numbers>

#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SensorQuantisation final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"q", "m", 1e-4, 1e-7, 5e-3, "step of the sensor"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"r", "-", 0.9, "sharpness of the edges, below 1", true},
  };

  std::string_view name() const override { return "sensor_quantisation"; }
  std::string_view formula() const override { return "y = q round(u / q), edges rounded"; }
  std::string_view meaning() const override { return "the displacement sensor is coarse"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  void observe(const Signal& at, const double* theta, const double* constants,
               const Seen& out) const override {
    const double q = theta[0], r = constants[0];
    for (int i = 0; i < at.n; ++i) {
      const double phi = 2.0 * std::numbers::pi * at.y[i] / q;
      const double c = std::cos(phi), s = std::sin(phi);
      const double angle = std::atan2(r * s, 1.0 + r * c);
      const double slope = r * (r + c) / (1.0 + r * (2.0 * c + r));  // d angle / d phi
      out.y[i] = at.y[i] - q / std::numbers::pi * angle;
      out.y_y[i] = 1.0 - 2.0 * slope;
      out.y_theta[0][i] = (phi * slope - angle) / std::numbers::pi;
    }
  }
};

}  // namespace

const Effect& sensor_quantisation() {
  static const SensorQuantisation effect;
  return effect;
}

}  // namespace shaker::estimator
