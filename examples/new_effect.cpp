// Adds an effect that the catalogue does not have: a formula in the model file. The library differentiates it.
// Here it is a spring that stiffens with its stroke, k u / (1 - u / length).
#include <cmath>
#include <cstdio>
#include <numbers>
#include <shaker/config/model.hpp>
#include <shaker/estimator/fit/estimation.hpp>

namespace {

constexpr double kStiffness = 300.0, kLength = 0.1, kDamping = 6.0;  // 1/s^2, m, 1/s

// One period of the oscillator's steady response to `amplitude` cos(2 pi f t), m: 200 periods from rest by the
// classical Runge-Kutta method.
shaker::estimator::RunData measured(double frequency_hz, double amplitude) {
  constexpr int kPoints = 64, kSteps = 32, kPeriods = 200;
  const double h = 1.0 / (frequency_hz * kPoints * kSteps);
  const auto force = [&](double t, double u, double v) {
    return amplitude * std::cos(2 * std::numbers::pi * frequency_hz * t) - kDamping * v -
           kStiffness * u / (1 - u / kLength);
  };
  shaker::estimator::RunData run{.frequency_hz = frequency_hz, .amplitude = amplitude};
  double u = 0.0, v = 0.0;
  for (int i = 0; i < kPeriods * kPoints * kSteps; ++i) {
    if (i >= (kPeriods - 1) * kPoints * kSteps && i % kSteps == 0) run.displacement.push_back(u);
    const double t = i * h;
    const double a1 = force(t, u, v), v2 = v + h / 2 * a1;
    const double a2 = force(t + h / 2, u + h / 2 * v, v2), v3 = v + h / 2 * a2;
    const double a3 = force(t + h / 2, u + h / 2 * v2, v3), v4 = v + h * a3;
    const double a4 = force(t + h, u + h * v3, v4);
    u += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return run;
}

}  // namespace

int main() {
  const auto spec = shaker::config::parse_model(R"json({
      "format": "shaker-model/1", "name": "bush", "effects": [
      {"effect": "viscous_damping", "parameters": {"c": {"start": 4}}},
      {"effect": "stiffening_spring", "formula": "k * u / (1 - u / length)",
       "parameters": {"k": {"start": 250, "unit": "1/s^2"}, "length": {"start": 0.12, "unit": "m"}}}]})json",
                                                "here");
  if (!spec) return std::puts(spec.error().what.c_str()), 1;
  const shaker::estimator::Model model(*spec);
  shaker::estimator::Estimator estimator(model, {measured(2.0, 5.0), measured(3.0, 6.0)});
  estimator.fit(model.start());
  for (const auto& p : estimator.describe().parameters)
    std::printf("%s = %.4f +- %.1g %s\n", p.name.c_str(), p.value, p.standard_error,
                p.unit.c_str());
}
