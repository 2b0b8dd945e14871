// Jobs J1 to J5 of the reference (tests/data/README.md), beside Ceres around the same banded solve
// in the same run; cost over points and runs. docs/benchmarks.md holds the last table.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "estimator/batch_estimation.hpp"
#include "estimator/ceres_estimation.hpp"
#include "estimator/estimation.hpp"
#include "estimator/paper/figures.hpp"
#include "estimator/periodic/sweep.hpp"

namespace {

using namespace shaker::estimator;

const std::vector<double> kStart = {5.08 * 1.05, 5.0 * 1.05, 1.62 * 1.05, 1.05};

std::vector<std::vector<double>> read(const std::string& name, bool header = true) {
  std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / name);
  std::vector<std::vector<double>> rows;
  std::string line;
  if (header) std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<double> row;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');)
      row.push_back(std::stod(cell));
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<RunData> job1() {
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 10.0;
  for (const auto& row : read("oleo_j1.csv"))
    run.displacement.push_back(row[1]);
  return {run};
}

std::vector<RunData> job2() {
  std::vector<RunData> runs;
  for (const auto& row : read("oleo_j2.csv")) {
    if (runs.size() <= static_cast<std::size_t>(row[0])) {
      runs.emplace_back();
      runs.back().frequency_hz = row[1];
      runs.back().amplitude = row[2];
    }
    runs.back().displacement.push_back(row[4]);
  }
  return runs;
}

const Model& model() {
  static const Model oleo(paper::oleo_in_feet(32.2));
  return oleo;
}

EstimationOptions options(int points) {
  EstimationOptions o;
  o.grid = {Scheme::order6, points, true};
  o.tolerance = 1e-8;
  return o;
}

void report_error(benchmark::State& state, const std::vector<double>& theta,
                  const std::vector<double>& exact) {
  double worst = 0.0;
  for (std::size_t k = 0; k < theta.size(); ++k)
    worst = std::max(worst, std::fabs(theta[k] / exact[k] - 1.0));
  state.counters["theta_error"] = worst;
}

const std::vector<double> kExact1 = {5.07211204441906529, 5.00120418377214045, 1.61949291391464562,
                                     1.00034344493321094};
const std::vector<double> kExact2 = {5.07789253929859125, 5.00626746885634505, 1.62024359930548565,
                                     0.9988344401914184};

// One estimate with covariance from a start 5 % off, to 1e-8 of theta.
void J1_shakerd(benchmark::State& state) {
  Estimator estimator(model(), job1(), options(static_cast<int>(state.range(0))));
  const Fit* fit = nullptr;
  for (auto _ : state) {
    fit = &estimator.fit(kStart);
    benchmark::DoNotOptimize(fit->covariance.data());
  }
  report_error(state, fit->theta, kExact1);
  state.counters["iterations"] = fit->iterations;
}
BENCHMARK(J1_shakerd)->Arg(80)->Arg(120)->Arg(160)->Arg(240)->Unit(benchmark::kMicrosecond);

void J1_ceres(benchmark::State& state) {
  CeresEstimator estimator(model(), job1(), options(static_cast<int>(state.range(0))));
  CeresFit fit;
  for (auto _ : state)
    fit = estimator.fit(kStart);
  report_error(state, fit.theta, kExact1);
  state.counters["iterations"] = fit.iterations;
}
BENCHMARK(J1_ceres)->Arg(80)->Unit(benchmark::kMicrosecond);

// Ceres around what one would build without the kink's correction: fourth order, as many points as
// the same millionth of theta takes.
void J1_ceres_plain_grid(benchmark::State& state) {
  EstimationOptions plain = options(static_cast<int>(state.range(0)));
  plain.grid.scheme = Scheme::order4;
  plain.grid.correct_kink = false;
  CeresEstimator estimator(model(), job1(), plain);
  CeresFit fit;
  for (auto _ : state)
    fit = estimator.fit(kStart);
  report_error(state, fit.theta, kExact1);
}
BENCHMARK(J1_ceres_plain_grid)->Arg(240)->Arg(320)->Unit(benchmark::kMicrosecond);

// Both in turn, so that the ratio is of the same minutes of the same machine.
void J1_ratio_to_ceres(benchmark::State& state) {
  Estimator ours(model(), job1(), options(80));
  CeresEstimator theirs(model(), job1(), options(80));
  double own = 0.0, other = 0.0;
  for (auto _ : state) {
    const auto a = std::chrono::steady_clock::now();
    for (int i = 0; i < 10; ++i)
      benchmark::DoNotOptimize(ours.fit(kStart).theta.data());
    const auto b = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(theirs.fit(kStart).theta.data());
    const auto c = std::chrono::steady_clock::now();
    own += std::chrono::duration<double>(b - a).count() / 10.0;
    other += std::chrono::duration<double>(c - b).count();
  }
  state.counters["ratio"] = other / own;
}
BENCHMARK(J1_ratio_to_ceres)->Unit(benchmark::kMicrosecond);

void J2_shakerd(benchmark::State& state) {
  Estimator estimator(model(), job2(), options(128));
  const Fit* fit = nullptr;
  for (auto _ : state) {
    fit = &estimator.fit(kStart);
    benchmark::DoNotOptimize(fit->covariance.data());
  }
  report_error(state, fit->theta, kExact2);
}
BENCHMARK(J2_shakerd)->Unit(benchmark::kMicrosecond);

void J2_ceres(benchmark::State& state) {
  CeresEstimator estimator(model(), job2(), options(128));
  CeresFit fit;
  for (auto _ : state)
    fit = estimator.fit(kStart);
  report_error(state, fit.theta, kExact2);
}
BENCHMARK(J2_ceres)->Unit(benchmark::kMicrosecond);

// J1 a thousand times with fresh noise, on one and on two threads. Real time: threads.
void J3_shakerd(benchmark::State& state) {
  Estimator estimator(model(), job1(), options(80));
  estimator.fit(paper::kExactTheta);
  const auto clean = estimator.predicted(0);
  const auto [low, high] = std::minmax_element(clean.begin(), clean.end());
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> noise(-0.005 * (*high - *low), 0.005 * (*high - *low));
  std::vector<double> records;
  for (int i = 0; i < 1000; ++i) {
    for (const double y : clean)
      records.push_back(y + noise(generator));
  }
  BatchEstimator batch(model(), job1()[0], options(80), static_cast<int>(state.range(0)));
  const BatchFit* fit = nullptr;
  for (auto _ : state)
    fit = &batch.fit(records, kStart);
  state.counters["converged"] =
      static_cast<double>(std::count(fit->status.begin(), fit->status.end(), FitStatus::converged));
}
BENCHMARK(J3_shakerd)
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

// One periodic solution from nothing with four sensitivities, through a coarse grid.
void J4_shakerd(benchmark::State& state) {
  const int points = static_cast<int>(state.range(0));
  const auto reference = read("oleo_j4_reference.csv", false);
  PeriodicSystem coarse(model(), {Scheme::order6, 40, true});
  PeriodicSystem fine(model(), {Scheme::order6, points, true});
  coarse.set_excitation(2.0, 10.0);
  fine.set_excitation(2.0, 10.0);
  for (auto _ : state) {
    coarse.solve_from_rest(paper::kExactTheta);
    fine.interpolate_from(coarse);
    fine.solve(paper::kExactTheta, 30, 1e-6);
    benchmark::DoNotOptimize(fine.row(0, 0).data());
  }
  double worst = 0.0;
  for (int k = 0; k <= 4; ++k) {
    double size = 0.0;
    double error = 0.0;
    for (int i = 0; i < 40; ++i) {
      const int point = i * points / 40;
      const double value =
          k == 0 ? fine.value(point, 0) : fine.row(point, 0)[static_cast<std::size_t>(k)];
      const double exact = reference[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
      size = std::max(size, std::fabs(exact));
      error = std::max(error, std::fabs(value - exact));
    }
    worst = std::max(worst, error / size);
  }
  state.counters["error"] = worst;
}
BENCHMARK(J4_shakerd)->Arg(120)->Arg(160)->Unit(benchmark::kMicrosecond);

// 200 frequencies, eight stretches of the sweep abreast.
void J5_shakerd(benchmark::State& state) {
  const int points = static_cast<int>(state.range(0));
  const auto reference = read("oleo_j5_reference.csv", false);
  std::vector<double> frequencies;
  for (const auto& row : reference)
    frequencies.push_back(row[0]);
  SweepOptions options;
  options.grid.points = points;
  FrequencySweep sweep(model(), options);
  for (auto _ : state)
    benchmark::DoNotOptimize(sweep.run(paper::kExactTheta, 10.0, frequencies));
  double worst = 0.0;
  for (std::size_t f = 0; f < reference.size(); ++f) {
    for (std::size_t i = 0; i < 40; ++i)
      worst =
          std::max(worst, std::fabs(sweep.solution(f)[i * static_cast<std::size_t>(points) / 40] -
                                    reference[f][1 + i]));
  }
  state.counters["error"] = worst;
  state.counters["steps"] = sweep.steps();
}
BENCHMARK(J5_shakerd)->Arg(120)->Arg(160)->Arg(240)->Unit(benchmark::kMillisecond);

// One linearisation with sensitivities, over the points: linear.
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

// A joint estimate over the number of runs: linear.
void estimate_over_runs(benchmark::State& state) {
  const auto base = job2();
  std::vector<RunData> runs;
  for (int i = 0; i < state.range(0); ++i)
    runs.push_back(base[static_cast<std::size_t>(i) % base.size()]);
  Estimator estimator(model(), runs, options(128));
  for (auto _ : state)
    benchmark::DoNotOptimize(estimator.fit(kStart).theta.data());
  state.SetComplexityN(state.range(0));
}
BENCHMARK(estimate_over_runs)
    ->RangeMultiplier(2)
    ->Range(6, 96)
    ->Complexity(benchmark::oN)
    ->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
