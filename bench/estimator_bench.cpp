// Jobs J1 to J5 of the reference (tests/data/README.md), and Ceres in the same run.
// docs/benchmarks.md has the last table; cost_bench.cpp has the other measurements.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/oleo_in_feet.hpp"
#include "bench/plain_reference.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/fit/internal/accurate_estimation.hpp"
#include "estimator/fit/internal/batch_estimation.hpp"
#include "estimator/paper/figures.hpp"
#include "estimator/paper/internal/ceres_estimation.hpp"
#include "estimator/solve/periodic/internal/accurate_solution.hpp"
#include "estimator/solve/periodic/internal/sweep.hpp"
#include "tests/estimator/benchmark_jobs.hpp"

namespace {

using namespace shaker;
using namespace shaker::estimator;

using bench::kStart;
using bench::model;
using bench::on_points;
using estimator::testing::job1;
using estimator::testing::job2;
using estimator::testing::read_csv;

double largest_error(const std::vector<double>& theta, const std::vector<double>& exact) {
  double worst = 0.0;
  for (std::size_t k = 0; k < theta.size(); ++k)
    worst = std::max(worst, std::fabs(theta[k] / exact[k] - 1.0));
  return worst;
}

void report_error(benchmark::State& state, const std::vector<double>& theta,
                  const std::vector<double>& exact) {
  state.counters["theta_error"] = largest_error(theta, exact);
}

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

const std::vector<double> kExact1 = {5.07211204441906529, 5.00120418377214045, 1.61949291391464562,
                                     1.00034344493321094};
const std::vector<double> kExact2 = {5.07789253929859125, 5.00626746885634505, 1.62024359930548565,
                                     0.9988344401914184};

// One estimate with covariance from a start 5 % above the truth, to 1e-8 of theta.
void J1_shakerd(benchmark::State& state) {
  Estimator estimator(model(), {job1()}, on_points(static_cast<int>(state.range(0))));
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
  CeresEstimator estimator(model(), {job1()}, on_points(static_cast<int>(state.range(0))));
  CeresFit fit;
  for (auto _ : state)
    fit = estimator.fit(kStart);
  report_error(state, fit.theta, kExact1);
  state.counters["iterations"] = fit.iterations;
}
BENCHMARK(J1_ceres)->Arg(80)->Unit(benchmark::kMicrosecond);

// Ceres around a solver that one would write without this library (plain_reference.hpp), on the
// fewest points with which the scheme reaches 1e-6 of theta. `ratio` is its time over that of
// our estimate of the same accuracy. Both are measured alternately, so that they see the same
// load of the machine.
void J1_plain_reference(benchmark::State& state, Scheme scheme) {
  const RunData run = job1();
  std::unique_ptr<bench::PlainReference> theirs;
  int points = 0;
  for (double error = 1.0; error > 1e-6;) {
    points += static_cast<int>(run.displacement.size());
    theirs = std::make_unique<bench::PlainReference>(model(), run, scheme, points, 1e-8);
    error = largest_error(theirs->fit(kStart), kExact1);
  }
  Estimator ours(model(), {run}, on_points(80));
  double own = 1e300, other = 1e300;
  const auto least = [](double& time, auto&& work) {
    const double before = cpu_seconds();
    work();
    time = std::min(time, cpu_seconds() - before);
  };
  for (auto _ : state) {
    least(other, [&] { benchmark::DoNotOptimize(theirs->fit(kStart).data()); });
    for (int i = 0; i < 5; ++i)
      least(own, [&] { benchmark::DoNotOptimize(ours.fit(kStart).theta.data()); });
  }
  report_error(state, theirs->fit(kStart), kExact1);
  state.counters["points"] = points;
  state.counters["theirs_us"] = 1e6 * other;
  state.counters["ours_us"] = 1e6 * own;
  state.counters["ratio"] = other / own;
}
BENCHMARK_CAPTURE(J1_plain_reference, order4, Scheme::order4)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(J1_plain_reference, order6, Scheme::order6)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(J1_plain_reference, fourier, Scheme::fourier)->Unit(benchmark::kMicrosecond);

// Ceres around our own solver, with its correction at velocity reversals.
void J1_ratio_to_ceres_around_our_solver(benchmark::State& state) {
  Estimator ours(model(), {job1()}, on_points(80));
  CeresEstimator theirs(model(), {job1()}, on_points(80));
  double own = 1e300, other = 1e300;
  for (auto _ : state) {
    const double a = cpu_seconds();
    benchmark::DoNotOptimize(ours.fit(kStart).theta.data());
    const double b = cpu_seconds();
    benchmark::DoNotOptimize(theirs.fit(kStart).theta.data());
    own = std::min(own, b - a);
    other = std::min(other, cpu_seconds() - b);
  }
  state.counters["theirs_us"] = 1e6 * other;
  state.counters["ours_us"] = 1e6 * own;
  state.counters["ratio"] = other / own;
}
BENCHMARK(J1_ratio_to_ceres_around_our_solver)->Unit(benchmark::kMicrosecond);

// The estimator chooses the grid for an accuracy of theta, 1e-6 and 1e-9; without prepared
// grids.
void J1_to_accuracy(benchmark::State& state) {
  AccurateOptions asked;
  asked.accuracy = std::pow(10.0, -static_cast<double>(state.range(0)));
  AccurateEstimator estimator(model(), {job1()}, asked);
  for (auto _ : state)
    benchmark::DoNotOptimize(estimator.fit(kStart).theta.data());
  report_error(state, estimator.finest().last().theta, kExact1);
  state.counters["estimated"] = estimator.error();
  state.counters["points"] = estimator.points();
}
BENCHMARK(J1_to_accuracy)->Arg(6)->Arg(9)->Unit(benchmark::kMicrosecond);

void J2_shakerd(benchmark::State& state) {
  Estimator estimator(model(), job2(), on_points(128));
  const Fit* fit = nullptr;
  for (auto _ : state) {
    fit = &estimator.fit(kStart);
    benchmark::DoNotOptimize(fit->covariance.data());
  }
  report_error(state, fit->theta, kExact2);
}
BENCHMARK(J2_shakerd)->Unit(benchmark::kMicrosecond);

void J2_ceres(benchmark::State& state) {
  CeresEstimator estimator(model(), job2(), on_points(128));
  CeresFit fit;
  for (auto _ : state)
    fit = estimator.fit(kStart);
  report_error(state, fit.theta, kExact2);
}
BENCHMARK(J2_ceres)->Unit(benchmark::kMicrosecond);

// J1 a thousand times with new noise, on one and on two threads. The real time is measured
// because of the threads, and the smallest one is taken, because other programs load the cores.
void J3_shakerd(benchmark::State& state) {
  Estimator estimator(model(), {job1()}, on_points(80));
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
  BatchEstimator batch(model(), job1(), on_points(80), static_cast<int>(state.range(0)));
  const BatchFit* fit = nullptr;
  double least = 1e300;
  for (auto _ : state) {
    const auto before = std::chrono::steady_clock::now();
    fit = &batch.fit(records, kStart);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - before;
    least = std::min(least, took.count());
  }
  state.counters["least_ms"] = 1e3 * least;
  state.counters["converged"] =
      static_cast<double>(std::count(fit->status.begin(), fit->status.end(), FitStatus::converged));
}
BENCHMARK(J3_shakerd)
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

// One periodic solution without a start value, with four sensitivities. The grid is refined until
// both are within 1e-6.
void J4_shakerd(benchmark::State& state) {
  const auto reference = read_csv("oleo_j4_reference.csv", false);
  AccurateSolution solution(model());
  solution.set_excitation(2.0, 10.0);
  AccuracyReport report;
  for (auto _ : state)
    report = solution.solve(paper::kExactTheta, 1e-6);
  const PeriodicSystem& fine = solution.system();
  double worst = 0.0;
  for (int k = 0; k <= 4; ++k) {
    double size = 0.0;
    double error = 0.0;
    for (int i = 0; i < 40; ++i) {
      const int point = i * fine.points() / 40;
      const double value =
          k == 0 ? fine.value(point, 0) : fine.row(point, 0)[static_cast<std::size_t>(k)];
      const double exact = reference[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
      size = std::max(size, std::fabs(exact));
      error = std::max(error, std::fabs(value - exact));
    }
    worst = std::max(worst, error / size);
  }
  state.counters["error"] = worst;
  state.counters["estimated"] = report.sensitivity_error;
  state.counters["points"] = fine.points();
}
BENCHMARK(J4_shakerd)->Unit(benchmark::kMicrosecond);

// 200 frequencies; eight sections of the sweep are solved as one batch.
void J5_shakerd(benchmark::State& state) {
  const int points = static_cast<int>(state.range(0));
  const auto reference = read_csv("oleo_j5_reference.csv", false);
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

}  // namespace

BENCHMARK_MAIN();
