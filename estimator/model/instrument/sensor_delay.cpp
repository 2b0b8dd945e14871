// y(t) = u(t - d): the measured displacement is late relative to the excitation.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SensorDelay final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"d", "s", 2e-3, 0.0, 0.03, "delay of the displacement against the excitation", 0.0},
  };

  std::string_view name() const override { return "sensor_delay"; }
  std::string_view formula() const override { return "y(t) = u(t - d)"; }
  std::string_view meaning() const override { return "the displacement sensor is late"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool filters() const override { return true; }
  std::complex<double> transfer(double omega, const double* theta, const double*,
                                std::complex<double>* d_theta) const override {
    const std::complex<double> factor = std::polar(1.0, -omega * theta[0]);
    d_theta[0] = std::complex<double>(0.0, -omega) * factor;
    return factor;
  }
};

}  // namespace

const Effect& sensor_delay() {
  static const SensorDelay effect;
  return effect;
}

}  // namespace shaker::estimator
