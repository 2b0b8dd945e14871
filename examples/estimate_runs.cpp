// Estimates an oscillator from two runs, one with a wrong sample, as `shakerctl estimate` does: from
// several starts, with a loss that a wrong sample does not move.
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <shaker/config/model.hpp>
#include <shaker/estimator/estimate.hpp>

int main() {
  namespace estimator = shaker::estimator;
  const auto spec =
      shaker::config::parse_model(R"({"format": "shaker-model/1", "name": "oscillator", "effects": [
      {"effect": "linear_stiffness", "parameters": {"k": {"start": 500}}},
      {"effect": "viscous_damping", "parameters": {"c": {"start": 2}}}]})",
                                  "here");
  if (!spec) return std::puts(spec.error().what.c_str()), 1;

  // 64 points of the response to 3 m/s^2, for k = 400 1/s^2 and c = 4 1/s, with an error of 0.05 mm.
  std::vector<estimator::RunData> runs;
  for (const double frequency_hz : {2.5, 3.5}) {
    auto& run =
        runs.emplace_back(estimator::RunData{.frequency_hz = frequency_hz, .amplitude = 3.0});
    const double omega = 2 * std::numbers::pi * frequency_hz;
    const auto response = run.amplitude / std::complex<double>(400.0 - omega * omega, 4.0 * omega);
    for (int i = 0; i < 64; ++i)
      run.displacement.push_back(
          (response * std::polar(1.0, 2 * std::numbers::pi * i / 64)).real() +
          5e-5 * std::sin(i * i + frequency_hz));
  }
  runs[0].displacement[20] += 0.01;

  estimator::RunsEstimateOptions options;
  options.starts = 4;
  options.loss = estimator::Loss::huber;
  const auto found = estimator::estimate(*spec, runs, options);
  if (!found) return std::puts(found.error().what.c_str()), 1;
  for (const auto& p : found->estimate.parameters)
    std::printf("%s = %.2f, from %.2f to %.2f %s\n", p.name.c_str(), p.value, p.lower, p.upper,
                p.unit.c_str());
  for (const auto& warning : found->estimate.warnings)
    std::printf("a warning: %s\n", warning.c_str());
}
