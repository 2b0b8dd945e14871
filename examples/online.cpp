// Feeds the on-line estimator by hand: one cycle after the other, an estimate after each.
#include <complex>
#include <cstdio>
#include <numbers>
#include <random>
#include <shaker/config/model.hpp>
#include <shaker/estimator/online/online_estimator.hpp>

int main() {
  const auto spec =
      shaker::config::parse_model(R"({"format": "shaker-model/1", "name": "oscillator", "effects": [
      {"effect": "linear_stiffness", "parameters": {"k": {"start": 500}}},
      {"effect": "viscous_damping", "parameters": {"c": {"start": 2}}}]})",
                                  "here");
  if (!spec) return std::puts(spec.error().what.c_str()), 1;
  shaker::estimator::OnlineEstimator estimator(*spec);

  std::mt19937 source(1);
  std::normal_distribution<double> noise(0.0, 1e-4);  // m
  shaker::estimator::MeasuredCycle cycle{.frequency_hz = 2.5, .amplitude = 3.0};
  const double omega = 2 * std::numbers::pi * cycle.frequency_hz;
  const auto response = cycle.amplitude / std::complex<double>(400.0 - omega * omega, 4.0 * omega);
  for (cycle.index = 0; cycle.index < 20; ++cycle.index) {
    cycle.displacement.clear();
    for (int i = 0; i < 64; ++i) {
      const auto turned = response * std::polar(1.0, 2 * std::numbers::pi * i / 64);
      cycle.displacement.push_back(turned.real() + noise(source));
    }
    const auto estimate = estimator.add(cycle);
    if (!estimate) return std::puts(estimate.error().what.c_str()), 1;
    std::printf("cycle %2ld:", cycle.index + 1);
    for (const auto& p : estimate->parameters)
      std::printf("  %s = %.3f, %.3f .. %.3f", p.name.c_str(), p.value, p.lower, p.upper);
    std::puts("");
  }
}
