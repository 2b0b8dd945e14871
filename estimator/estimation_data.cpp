// The data of an estimation on their grids, and a start from the data themselves.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/estimation_impl.hpp"

namespace shaker::estimator {
namespace {

constexpr int kStartHarmonics = 3;  // more would carry the noise into the accelerations
constexpr std::size_t kFewestCoarse = 24;

// Least multiple of the data's points that is at least `least`, when the data are on equal steps.
int grid_points(const RunData& run, int least) {
  if (!run.tau.empty()) return least;
  const int count = static_cast<int>(run.displacement.size());
  return count * ((least + count - 1) / count);
}

}  // namespace

Estimator::Impl::Impl(const Model& the_model, std::vector<RunData> data, EstimationOptions opt)
    : model(the_model), options(opt) {
  if (data.empty()) throw std::invalid_argument("there is no run to estimate from");
  const auto p = static_cast<std::size_t>(model.parameter_count());
  for (std::size_t k = 0; k < p; ++k) {
    if (!model.parameters()[k].fixed) free.push_back(static_cast<int>(k));
  }
  systems.reserve(data.size());
  for (std::size_t r = 0; r < data.size(); ++r) {
    check_run(data[r], r);
    GridOptions grid = options.grid;
    grid.points = grid_points(data[r], grid.points);
    systems.emplace_back(model, grid);
    runs.emplace_back();
    runs[r].data = std::move(data[r]);
    prepare_readings(runs[r], grid.points);
    prepare_harmonics(runs[r], grid.points);
    runs[r].saved.resize(systems[r].state().size());
  }
  make_coarse_level();
  for (std::size_t r = 0; r < runs.size(); ++r)
    load(r);
  const std::size_t q = free.size();
  gram.resize(q * q);
  scratch_matrix.resize(q * q);
  factors.resize(q * q);
  gradient.resize(q);
  scratch_vector.resize(q);
  delta.resize(q);
  held.resize(q);
  delta_full.resize(p);
  theta_saved.resize(p);
  mixed_.resize(1 + p);
  products.resize((1 + p) * (1 + p));
  fit.theta.resize(p);
  fit.standard_error.resize(p);
  fit.at_bound.resize(p);
  fit.determined.resize(p);
  fit.covariance.resize(q * q);
}

void Estimator::Impl::make_coarse_level() {
  const bool possible = options.method == Method::lifted &&
                        options.grid.scheme != Scheme::fourier &&
                        std::all_of(runs.begin(), runs.end(), [](const RunState& run) {
                          return run.every >= 2 && run.data.displacement.size() >= kFewestCoarse;
                        });
  if (!possible) return;
  coarse.reserve(runs.size());
  for (const RunState& run : runs) {
    GridOptions grid = options.grid;
    grid.points = static_cast<int>(run.data.displacement.size());
    coarse.emplace_back(model, grid);
  }
}

void Estimator::Impl::load(std::size_t r) {
  RunState& run = runs[r];
  run.inverse_variance = run.data.cycles * run.data.weight;
  const auto put = [&](PeriodicSystem& system) {
    if (run.data.excitation.empty())
      system.set_excitation(run.data.frequency_hz, run.data.amplitude);
    else
      system.set_excitation(run.data.frequency_hz, run.data.excitation,
                            options.excitation_harmonics);
  };
  put(systems[r]);
  if (!coarse.empty()) put(coarse[r]);
}

void Estimator::Impl::prepare_readings(RunState& run, int points) {
  const std::size_t count = run.data.displacement.size();
  run.readings.resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    Reading& reading = run.readings[j];
    if (run.data.tau.empty()) {
      run.every = points / static_cast<int>(count);
      reading.base = static_cast<int>(j) * run.every;
      continue;
    }
    // Lagrange interpolation of degree 5 on the six points around tau.
    double at = run.data.tau[j] - std::floor(run.data.tau[j]);
    at *= points;
    const int first = static_cast<int>(std::floor(at)) - 2;
    reading.base = (first + points) % points;
    reading.count = 6;
    for (int k = 0; k < 6; ++k) {
      double w = 1.0;
      for (int m = 0; m < 6; ++m) {
        if (m != k) w *= (at - (first + m)) / (k - m);
      }
      reading.weight[k] = w;
    }
  }
}

// Tables that turn the data into their first harmonics and those into a state on the grid.
void Estimator::Impl::prepare_harmonics(RunState& run, int points) {
  if (model.coordinates() != 1 || !run.data.tau.empty()) return;
  const int count = static_cast<int>(run.data.displacement.size());
  const int terms = 1 + 2 * std::min(kStartHarmonics, (count - 1) / 2);
  const auto fill = [&](std::vector<double>& table, int n, double mean, double rest) {
    table.resize(static_cast<std::size_t>(n) * terms);
    for (int i = 0; i < n; ++i) {
      for (int t = 0; t < terms; ++t) {
        const double angle = 2.0 * std::numbers::pi * ((t + 1) / 2) * i / n;
        table[i * terms + t] =
            t == 0 ? mean : rest * (t % 2 == 1 ? std::cos(angle) : std::sin(angle));
      }
    }
  };
  fill(run.analysis, count, 1.0 / count, 2.0 / count);
  fill(run.synthesis, points, 1.0, 1.0);
  run.coefficients.resize(terms);
}

bool Estimator::Impl::start_from_data(std::size_t r, PeriodicSystem& system) {
  RunState& run = runs[r];
  if (run.analysis.empty()) return false;
  const std::size_t terms = run.coefficients.size();
  std::fill(run.coefficients.begin(), run.coefficients.end(), 0.0);
  for (std::size_t j = 0; j < run.data.displacement.size(); ++j) {
    const double* table = &run.analysis[j * terms];
    for (std::size_t t = 0; t < terms; ++t)
      run.coefficients[t] += table[t] * run.data.displacement[j];
  }
  const auto state = system.state();
  const std::size_t every = run.synthesis.size() / terms / state.size();
  for (std::size_t i = 0; i < state.size(); ++i) {
    const double* table = &run.synthesis[i * every * terms];
    double sum = 0.0;
    for (std::size_t t = 0; t < terms; ++t)
      sum += table[t] * run.coefficients[t];
    state[i] = sum;
  }
  return true;
}

void check_run(const RunData& run, std::size_t index) {
  const auto reject = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("run {}: {}", index + 1, why));
  };
  if (!(run.frequency_hz > 0.0) || !std::isfinite(run.frequency_hz))
    reject(fmt::format("the frequency is {} Hz; it must be positive", run.frequency_hz));
  if (run.displacement.size() < 8)
    reject(fmt::format("{} points of displacement are too few; a period needs at least 8",
                       run.displacement.size()));
  if (!run.tau.empty() && run.tau.size() != run.displacement.size())
    reject(fmt::format("{} times for {} displacements", run.tau.size(), run.displacement.size()));
  const auto all_finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  if (!all_finite(run.displacement) || !all_finite(run.tau) || !all_finite(run.excitation))
    reject("a sample is missing or not finite; leave such samples out");
  double largest = std::fabs(run.amplitude);
  for (const double x : run.excitation)
    largest = std::max(largest, std::fabs(x));
  if (run.excitation.empty() ? largest == 0.0 : run.excitation.size() < 3)
    reject("the excitation has no amplitude; without motion there is nothing to estimate from");
  if (!(run.cycles > 0.0) || !(run.weight > 0.0)) reject("cycles and weight must be positive");
}

}  // namespace shaker::estimator
