// tau y' + y = u: the displacement sensor or its filter is slow (first-order low pass).
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SensorLag final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"tau", "s", 5e-3, 0.0, 0.05, "time constant of the low pass", 0.0},
  };

  std::string_view name() const override { return "sensor_lag"; }
  std::string_view formula() const override { return "tau y' + y = u"; }
  std::string_view meaning() const override { return "the displacement sensor is slow"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool filters() const override { return true; }
  std::complex<double> transfer(double omega, const double* theta, const double*,
                                std::complex<double>* d_theta) const override {
    const std::complex<double> factor = 1.0 / std::complex<double>(1.0, omega * theta[0]);
    d_theta[0] = std::complex<double>(0.0, -omega) * factor * factor;
    return factor;
  }
};

}  // namespace

const Effect& sensor_lag() {
  static const SensorLag effect;
  return effect;
}

}  // namespace shaker::estimator
