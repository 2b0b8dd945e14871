// Measures how the cost depends on points, runs, threads, formulas and profiles. Part of
// bench_estimator.
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/oleo_in_feet.hpp"
#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/fit/internal/batch_estimation.hpp"
#include "estimator/inference/internal/profile.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/formula/formula_effect.hpp"
#include "estimator/paper/figures.hpp"

namespace {

using namespace shaker;
using namespace shaker::estimator;
using bench::kStart;
using bench::model;
using bench::on_points;

// The model's own response, with a ripple instead of noise.
RunData made_up_run(double frequency, double amplitude, int samples) {
  PeriodicSystem system(model(), {Scheme::order6, 256, true});
  system.set_excitation(frequency, amplitude);
  system.solve_from_rest(paper::kExactTheta);
  RunData run;
  run.frequency_hz = frequency;
  run.amplitude = amplitude;
  for (int j = 0; j < samples; ++j)
    run.displacement.push_back(system.value(j * 256 / samples, 0) + 1e-4 * std::cos(2.4 * j * j));
  return run;
}

// One linearisation with sensitivities, over the number of points: linear cost.
void step_over_points(benchmark::State& state) {
  PeriodicSystem system(model(), {Scheme::order6, static_cast<int>(state.range(0)), true});
  system.set_excitation(2.0, 10.0);
  system.solve_from_rest(paper::kExactTheta);
  for (auto _ : state) {
    system.linearise(paper::kExactTheta);
    system.solve_step();
  }
  state.SetComplexityN(state.range(0));
}
BENCHMARK(step_over_points)
    ->RangeMultiplier(2)
    ->Range(64, 4096)
    ->Complexity(benchmark::oN)
    ->Unit(benchmark::kMicrosecond);

// A joint estimate over the number of runs: linear cost.
void estimate_over_runs(benchmark::State& state) {
  std::vector<RunData> runs;
  for (int i = 0; i < state.range(0); ++i)
    runs.push_back(made_up_run(1.0 + 0.25 * (i % 12), 10.0, 64));
  Estimator estimator(model(), runs, on_points(128));
  for (auto _ : state)
    benchmark::DoNotOptimize(estimator.fit(kStart).theta.data());
  state.SetComplexityN(state.range(0));
}
BENCHMARK(estimate_over_runs)
    ->RangeMultiplier(2)
    ->Range(6, 96)
    ->Complexity(benchmark::oN)
    ->Unit(benchmark::kMicrosecond);

// The same estimates distributed to threads. Measures real time and CPU time of the process; on
// an idle machine two threads halve the real time.
void batch_over_threads(benchmark::State& state) {
  const RunData run = made_up_run(2.0, 10.0, 32);
  std::vector<double> records;
  for (int r = 0; r < 1024; ++r) {
    for (std::size_t j = 0; j < run.displacement.size(); ++j)
      records.push_back(run.displacement[j] +
                        1e-4 * std::cos(1.7 * static_cast<double>(r) * static_cast<double>(j + 1)));
  }
  BatchEstimator batch(model(), run, on_points(96), static_cast<int>(state.range(0)));
  for (auto _ : state)
    benchmark::DoNotOptimize(batch.fit(records, kStart).theta.data());
}
BENCHMARK(batch_over_threads)
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

// From the data to an estimate with profile intervals of all parameters, without prepared
// objects.
void cold_estimate_with_profiles(benchmark::State& state) {
  const RunData run = made_up_run(2.0, 10.0, 32);
  std::size_t points = 0;
  for (auto _ : state) {
    Estimator estimator(model(), {run});
    estimator.fit(kStart);
    points = 0;
    for (const ProfileInterval& interval : profile_intervals(estimator, model()))
      points += interval.points.size();
  }
  state.counters["fits"] = static_cast<double>(points);
}
BENCHMARK(cold_estimate_with_profiles)->Unit(benchmark::kMillisecond);

// The gas spring at 160 points, from the catalogue and as a formula in a model file.
void effect_at_points(benchmark::State& state, bool by_formula) {
  constexpr int kPoints = 160;
  config::EffectSpec spec;
  spec.effect = "my_gas";
  spec.formula = "theta2 * (1 - theta3 * u)^(-theta4)";
  for (const char* name : {"theta2", "theta3", "theta4"})
    spec.parameters[name].start = 1.0;
  const auto own = make_formula_effect(spec);
  const Effect& effect = by_formula ? *own : gas_spring();
  AlignedVector u(kPoints), zero(kPoints), out[7];
  for (int i = 0; i < kPoints; ++i)
    u[static_cast<std::size_t>(i)] = 0.1 + 0.05 * std::sin(0.04 * i);
  for (AlignedVector& array : out)
    array.resize(kPoints);
  double* theta[3] = {out[4].data(), out[5].data(), out[6].data()};
  Points at;
  at.n = kPoints;
  at.u = u.data();
  at.v = at.a = at.x = zero.data();
  Forces forces;
  forces.f = out[0].data();
  forces.f_u = out[1].data();
  forces.f_v = out[2].data();
  forces.f_a = out[3].data();
  forces.f_theta = theta;
  const double values[3] = {5.0, 1.62, 1.0};
  for (auto _ : state) {
    benchmark::DoNotOptimize(effect.evaluate(at, values, nullptr, forces));
    benchmark::ClobberMemory();
  }
}
BENCHMARK_CAPTURE(effect_at_points, catalogue, false);
BENCHMARK_CAPTURE(effect_at_points, formula, true);

}  // namespace
