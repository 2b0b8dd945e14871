// Names what a model lacks: the records of an oscillator with a cubic spring, held against a linear one.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <shaker/config/model.hpp>
#include <shaker/estimator/diagnosis/diagnose.hpp>

namespace {

namespace diagnosis = shaker::estimator::diagnosis;

// 30 periods, sampled 1000 times a second, of u'' + 8 u' + 350 u + 4e5 u^3 = `amplitude` cos(2 pi f t).
diagnosis::Recording recorded(const char* name, double frequency_hz, double amplitude) {
  diagnosis::Recording run;
  run.name = name;
  run.frequency_hz = frequency_hz;
  run.amplitude = amplitude;
  std::mt19937 source(static_cast<unsigned>(100 * frequency_hz));
  std::normal_distribution<double> noise(0.0, 2e-5);  // m
  constexpr int kSteps = 4;
  constexpr double kRate = 1000.0, h = 1.0 / (kRate * kSteps);
  const auto drive = [&](double t) {
    return amplitude * std::cos(2 * std::numbers::pi * frequency_hz * t);
  };
  const auto force = [&](double t, double u, double v) {
    return drive(t) - 8.0 * v - 350.0 * u - 4e5 * u * u * u;
  };
  double u = 0.0, v = 0.0;
  for (int i = 0; i < static_cast<int>(30 / frequency_hz * kRate) * kSteps; ++i) {
    const double t = i * h;
    if (i % kSteps == 0) {
      run.t.push_back(t);
      run.displacement.push_back(u + noise(source));
      run.excitation.push_back(drive(t));
    }
    // The classical Runge-Kutta method.
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
  const auto spec =
      shaker::config::parse_model(R"({"format": "shaker-model/1", "name": "oscillator", "effects": [
      {"effect": "linear_stiffness", "parameters": {"k": {"start": 300}}},
      {"effect": "viscous_damping", "parameters": {"c": {"start": 5}}}]})",
                                  "here");
  if (!spec) return std::puts(spec.error().what.c_str()), 1;
  diagnosis::Campaign campaign{.name = "bush", .runs = {}, .warnings = {}};
  campaign.runs = {recorded("slow", 1.5, 4.0), recorded("middle", 3.0, 6.0),
                   recorded("fast", 4.5, 8.0)};

  const auto diagnosis = diagnosis::diagnose(campaign, *spec);
  if (!diagnosis) return std::puts(diagnosis.error().what.c_str()), 1;
  std::printf("%s\n", diagnosis::name(diagnosis->verdict));
  for (const auto& effect : diagnosis->effects)
    std::printf("%s, probability %.2f\n", effect.name.c_str(), effect.probability);
}
