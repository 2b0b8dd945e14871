// The steady response of a linear oscillator is known in closed form. The installed estimator
// must find its stiffness and damping from one period.
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "config/model.hpp"
#include "estimator/estimation.hpp"
#include "estimator/model.hpp"

int main() {
  constexpr double kStiffness = 400.0, kDamping = 4.0, kFrequency = 2.5, kAmplitude = 3.0;
  const auto spec = shaker::config::parse_model(R"({
    "format": "shaker-model/1", "name": "oscillator",
    "effects": [{"effect": "linear_stiffness", "parameters": {"k": {"start": 500}}},
                {"effect": "viscous_damping", "parameters": {"c": {"start": 2}}}]})",
                                                "inline");
  if (!spec) {
    std::printf("%s\n", spec.error().what.c_str());
    return 1;
  }
  const shaker::estimator::Model model(*spec);

  const double omega = 2 * std::numbers::pi * kFrequency;
  const std::complex<double> response =
      kAmplitude / std::complex<double>(kStiffness - omega * omega, kDamping * omega);
  shaker::estimator::RunData run;
  run.frequency_hz = kFrequency;
  run.amplitude = kAmplitude;
  for (int i = 0; i < 64; ++i) {
    const double angle = 2 * std::numbers::pi * i / 64;
    run.displacement.push_back((response * std::polar(1.0, angle)).real());
  }
  shaker::estimator::Estimator estimator(model, {run});
  const auto& fit = estimator.fit(model.start());
  std::printf("k = %.6f (%g), c = %.6f (%g)\n", fit.theta[0], kStiffness, fit.theta[1], kDamping);
  const bool found = fit.status == shaker::estimator::FitStatus::converged &&
                     std::abs(fit.theta[0] / kStiffness - 1) < 1e-5 &&
                     std::abs(fit.theta[1] / kDamping - 1) < 1e-5;
  return found ? 0 : 1;
}
