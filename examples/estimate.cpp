// Estimates the stiffness and the damping of an oscillator from one mean cycle of its response.
#include <complex>
#include <cstdio>
#include <numbers>
#include <shaker/config/model.hpp>
#include <shaker/estimator/fit/estimation.hpp>

int main() {
  const auto spec =
      shaker::config::parse_model(R"({"format": "shaker-model/1", "name": "oscillator", "effects": [
      {"effect": "linear_stiffness", "parameters": {"k": {"start": 500}}},
      {"effect": "viscous_damping", "parameters": {"c": {"start": 2}}}]})",
                                  "here");
  if (!spec) return std::puts(spec.error().what.c_str()), 1;
  const shaker::estimator::Model model(*spec);

  // The measurement: 64 points of the response to 3 m/s^2 at 2.5 Hz, for k = 400 1/s^2 and c = 4 1/s.
  shaker::estimator::RunData run{.frequency_hz = 2.5, .amplitude = 3.0};
  const double omega = 2 * std::numbers::pi * run.frequency_hz;
  const auto response = run.amplitude / std::complex<double>(400.0 - omega * omega, 4.0 * omega);
  for (int i = 0; i < 64; ++i)
    run.displacement.push_back((response * std::polar(1.0, 2 * std::numbers::pi * i / 64)).real());

  shaker::estimator::Estimator estimator(model, {run});
  estimator.fit(model.start());
  for (const auto& p : estimator.describe().parameters)
    std::printf("%s = %.4f +- %.1g %s\n", p.name.c_str(), p.value, p.standard_error,
                p.unit.c_str());
}
