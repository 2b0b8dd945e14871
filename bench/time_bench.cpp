// The cost of time integration: one gradient by (5.10), (5.11) and differences, and long
// records.
// Run: build/bench/bench_time
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "estimator/fit/records/transient.hpp"
#include "estimator/paper/figures.hpp"

namespace {

using namespace shaker::estimator;

const Model& oleo() {
  static const Model model(paper::oleo_in_feet(32.174));
  return model;
}

// Trajectory and gradient of the record of figure 9: 51 samples, 6 unknowns.
void gradient(benchmark::State& state, Integrator integrator, Gradient kind, CutAtReversals cut,
              bool sensitivities) {
  const StateEquations equations(oleo());
  TimeOptions options;
  options.integrator = integrator;
  options.gradient = kind;
  options.cut = cut;
  const auto integration = TimeIntegration::make(equations, options, {0, 1, 2, 3});
  std::vector<double> t;
  for (int i = 0; i <= 50; ++i)
    t.push_back(0.01 * i);
  const Excitation none;
  Arc arc;
  arc.times = t;
  arc.excitation = &none;
  arc.start = {0.4, 0.0};
  for (auto _ : state)
    benchmark::DoNotOptimize(integration->run({&arc, 1}, paper::kExactTheta, sensitivities).ok);
}

constexpr auto kAuto = CutAtReversals::automatic;
BENCHMARK_CAPTURE(gradient, adams_trajectory_alone, Integrator::adams, Gradient::sensitivities,
                  kAuto, false);
BENCHMARK_CAPTURE(gradient, adams_sensitivities, Integrator::adams, Gradient::sensitivities, kAuto,
                  true);
BENCHMARK_CAPTURE(gradient, adams_augmented, Integrator::adams, Gradient::augmented_states, kAuto,
                  true);
BENCHMARK_CAPTURE(gradient, adams_differences, Integrator::adams, Gradient::finite_differences,
                  kAuto, true);
BENCHMARK_CAPTURE(gradient, adams_cut_at_reversals, Integrator::adams, Gradient::sensitivities,
                  CutAtReversals::always, true);
BENCHMARK_CAPTURE(gradient, bdf_sensitivities, Integrator::bdf, Gradient::sensitivities, kAuto,
                  true);
BENCHMARK_CAPTURE(gradient, bdf_augmented, Integrator::bdf, Gradient::augmented_states, kAuto,
                  true);
BENCHMARK_CAPTURE(gradient, bdf_differences, Integrator::bdf, Gradient::finite_differences, kAuto,
                  true);
BENCHMARK_CAPTURE(gradient, rk4_sensitivities, Integrator::runge_kutta4, Gradient::sensitivities,
                  kAuto, true);
BENCHMARK_CAPTURE(gradient, rk4_differences, Integrator::runge_kutta4, Gradient::finite_differences,
                  kAuto, true);

// One gradient of a long record at 500 Hz, split into `segments` arcs that are integrated as a
// batch.
void long_record(benchmark::State& state, Integrator integrator) {
  const auto samples = static_cast<std::size_t>(state.range(0));
  const auto segments = static_cast<std::size_t>(state.range(1));
  const StateEquations equations(oleo());
  TimeOptions options;
  options.integrator = integrator;
  options.relative_tolerance = 1e-9;
  const auto integration = TimeIntegration::make(equations, options, {0, 1, 2, 3});
  std::vector<double> t, x;
  for (std::size_t i = 0; i < samples; ++i) {
    t.push_back(0.002 * static_cast<double>(i));
    x.push_back(6.0 * std::cos(9.0 * t.back()) + 4.0 * std::cos(14.3 * t.back() + 1.0));
  }
  const auto excitation = Excitation::sampled(t, x);
  std::vector<Arc> arcs;
  const std::size_t length = samples / segments;
  for (std::size_t s = 0; s < segments; ++s) {
    Arc arc;
    arc.times = std::span<const double>(t).subspan(s * length, length);
    arc.excitation = &excitation;
    arc.start = {0.5, 0.0};
    arcs.push_back(std::move(arc));
  }
  for (auto _ : state)
    benchmark::DoNotOptimize(integration->run(arcs, paper::kExactTheta, true).ok);
  state.counters["per_sample"] = benchmark::Counter(
      static_cast<double>(samples),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(long_record, rk4, Integrator::runge_kutta4)
    ->Args({10000, 1})
    ->Args({10000, 64})
    ->Args({100000, 64})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(long_record, adams, Integrator::adams)
    ->Args({10000, 1})
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
