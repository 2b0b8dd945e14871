#include "estimator/fit/internal/fit_data.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/math/dense.hpp"
#include "estimator/math/harmonic_basis.hpp"
#include "estimator/solve/periodic/multi_period.hpp"

namespace shaker::estimator {
namespace {

constexpr int kStartHarmonics = 3;  // higher ones would bring noise into the accelerations
constexpr double kMinSubharmonicShare = 0.1;  // of the data's subharmonic share
constexpr double kMinRelativeVariance =
    1e-12;  // of the mean square; a smaller variance is rounding

// Number of grid points, at least `least`. For data on equal steps: the smallest such multiple of
// the number of data.
int grid_points(const RunData& run, int least) {
  if (!run.harmonics.empty()) return std::max(least, 4 * static_cast<int>(run.harmonics.size()));
  if (!run.tau.empty()) return least;
  const int count = static_cast<int>(run.displacement.size());
  return count * ((least + count - 1) / count);
}

Eigen::MatrixXd covariance_of(const RunData& run) {
  const auto m = static_cast<Eigen::Index>(run.harmonics.size());
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(run.harmonic_covariance.data(), m, m);
}

template <class Reject>
void check_harmonics(const RunData& run, const Reject& reject) {
  const std::size_t m = run.harmonics.size();
  if (!run.displacement.empty() || !run.tau.empty())
    reject("it has both samples and Fourier coefficients; give one of them");
  if (m < 3 || m % 2 == 0)
    reject(
        fmt::format("{} Fourier coefficients; there must be the mean and a cosine and a sine "
                    "for each harmonic: 3, 5, 7, ...",
                    m));
  if (run.harmonic_covariance.size() != m * m)
    reject(fmt::format("the covariance of {} Fourier coefficients has {} numbers; it needs {}", m,
                       run.harmonic_covariance.size(), m * m));
  const auto finite = [](double v) { return std::isfinite(v); };
  if (!std::all_of(run.harmonics.begin(), run.harmonics.end(), finite) ||
      !std::all_of(run.harmonic_covariance.begin(), run.harmonic_covariance.end(), finite))
    reject("a Fourier coefficient or its covariance is missing or not finite");
  const Eigen::MatrixXd covariance = covariance_of(run);
  const Eigen::VectorXd size = covariance.diagonal().cwiseAbs().cwiseSqrt();
  const Eigen::MatrixXd unit =
      size.cwiseInverse().asDiagonal() * covariance * size.cwiseInverse().asDiagonal();
  if (!((unit - unit.transpose()).cwiseAbs().maxCoeff() < 1e-9))
    reject(
        "the covariance of its Fourier coefficients is not symmetric, or has a zero on its "
        "diagonal");
  const double smallest = spectrum_of(unit).values[0];
  if (!(smallest > 1e-13))
    reject(
        fmt::format("the covariance of its {} Fourier coefficients is singular; the scatter of N "
                    "cycles can weigh at most N - 1 coefficients: add cycles, or leave out the "
                    "higher harmonics",
                    m));
  if (run.covariance_degrees > 0.0 && run.covariance_degrees < static_cast<double>(m))
    reject(
        fmt::format("a covariance with {:g} degrees of freedom cannot weigh {} Fourier "
                    "coefficients: add cycles, or leave out the higher harmonics",
                    run.covariance_degrees, m));
}

void prepare_readings(RunState& run) {
  const int points = run.grid.points;
  const std::size_t count = run.data.displacement.size();
  run.readings.resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    GridReading& reading = run.readings[j];
    if (run.data.tau.empty()) {
      run.every = points / static_cast<int>(count);
      reading.base = static_cast<int>(j) * run.every;
      continue;
    }
    reading = grid_reading_at(run.data.tau[j], points);
  }
}

// Tables that turn the data into their first harmonics, and these into a state on the grid.
void prepare_harmonics(RunState& run) {
  if (!run.data.tau.empty()) return;
  const int count =
      static_cast<int>(run.harmonic() ? run.data.harmonics.size() : run.data.displacement.size());
  const int terms = 1 + 2 * std::min(kStartHarmonics * run.data.periods, (count - 1) / 2);
  const auto fill = [&](std::vector<double>& table, int n, double mean, double rest) {
    table.resize(static_cast<std::size_t>(n) * terms);
    for (int i = 0; i < n; ++i) {
      for (int t = 0; t < terms; ++t)
        table[i * terms + t] = (t == 0 ? mean : rest) * harmonic_term(t, i, n);
    }
  };
  if (!run.harmonic()) fill(run.analysis, count, 1.0 / count, 2.0 / count);
  fill(run.synthesis, run.grid.points, 1.0, 1.0);
  run.coefficients.resize(terms);
}

// L^-1 times the harmonic analysis of a state on the grid, and L^-1 times the data.
void prepare_projector(RunState& run) {
  const int points = run.grid.points;
  const auto m = static_cast<Eigen::Index>(run.data.harmonics.size());
  const Cholesky factor(covariance_of(run.data));
  Eigen::MatrixXd analysis(m, points);
  for (Eigen::Index j = 0; j < m; ++j) {
    for (int i = 0; i < points; ++i)
      analysis(j, i) =
          (j == 0 ? 1.0 : 2.0) / points * harmonic_term(static_cast<int>(j), i, points);
  }
  analysis = factor.whiten(analysis);
  const Eigen::VectorXd data = factor.whiten(
      Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(run.data.harmonics.data(), m)));
  run.whitened.assign(data.begin(), data.end());
  run.projector.assign(analysis.data(), analysis.data() + analysis.size());
}

}  // namespace

FitData::FitData(const Model& the_model, std::vector<RunData> given, EstimationOptions how)
    : model(the_model), options(how) {
  if (given.empty()) throw std::invalid_argument("there is no run to estimate from");
  const auto p = static_cast<std::size_t>(model.parameter_count());
  for (std::size_t k = 0; k < p; ++k) {
    const ModelParameter& parameter = model.parameters()[k];
    if (parameter.fixed) continue;
    free.push_back(static_cast<int>(k));
    priors = priors || parameter.prior_mean.has_value();
  }
  covariances = !given.front().harmonics.empty();
  for (std::size_t r = 0; r < given.size(); ++r) {
    check_run(given[r], r);
    if (given[r].harmonics.empty() == covariances)
      throw std::invalid_argument(
          fmt::format("run {} has {}, run 1 has {}; the noise of the two cannot be compared: give "
                      "the same for all runs",
                      r + 1, covariances ? "samples" : "Fourier coefficients with their covariance",
                      covariances ? "Fourier coefficients with their covariance" : "samples"));
    RunState& run = runs.emplace_back();
    run.grid = options.grid;
    run.grid.points = grid_points(given[r], run.grid.points * given[r].periods);
    run.data = std::move(given[r]);
    if (run.harmonic())
      run.whitened.resize(run.data.harmonics.size());
    else
      prepare_readings(run);
    prepare_harmonics(run);
  }
  for (std::size_t r = 0; r < runs.size(); ++r)
    load(r);
  mixed_.resize(1 + p);
}

void FitData::load(std::size_t r) {
  RunState& run = runs[r];
  run.inverse_variance = run.data.cycles * run.data.weight;
  if (run.harmonic()) prepare_projector(run);
  total_scatter = 0.0;
  observations = 0;
  for (const RunState& each : runs) {
    total_scatter += each.data.weight * each.data.scatter;
    const double n = static_cast<double>(each.data.displacement.size());
    observations += each.harmonic() ? static_cast<long>(each.data.harmonics.size())
                                    : static_cast<long>(n * each.data.cycles + 0.5);
  }
}

bool FitData::start_from_data(std::size_t r, PeriodicSystem& system, double share) {
  RunState& run = runs[r];
  if (run.synthesis.empty()) return false;
  system.begin();
  const std::size_t terms = run.coefficients.size();
  std::fill(run.coefficients.begin(), run.coefficients.end(), 0.0);
  if (run.harmonic()) std::copy_n(run.data.harmonics.begin(), terms, run.coefficients.begin());
  for (std::size_t j = 0; j < run.data.displacement.size(); ++j) {
    const double* table = &run.analysis[j * terms];
    for (std::size_t t = 0; t < terms; ++t)
      run.coefficients[t] += table[t] * run.data.displacement[j];
  }
  const auto state = system.state();
  const auto coordinates = static_cast<std::size_t>(model.coordinates());
  const auto points = static_cast<std::size_t>(system.points());
  const std::size_t every = run.synthesis.size() / terms / points;
  for (std::size_t i = 0; i < points; ++i) {
    const double* table = &run.synthesis[i * every * terms];
    double sum = 0.0;
    for (std::size_t t = 0; t < terms; ++t)
      sum += table[t] * run.coefficients[t];
    double& z = state[i * coordinates + static_cast<std::size_t>(model.observed())];
    z = share < 1.0 ? z + share * (sum - z) : sum;  // the whole way: no trace of a fit before
  }
  return true;
}

double FitData::motion(std::size_t r) const {
  const std::vector<double>& y = runs[r].data.displacement;
  double mean = 0.0, square = 0.0;
  for (const double value : y) {
    mean += value / static_cast<double>(y.size());
    square += value * value / static_cast<double>(y.size());
  }
  // A record without motion is on no branch.
  const double variance = square - mean * mean;
  return variance > kMinRelativeVariance * square ? std::sqrt(variance) : 0.0;
}

double FitData::misfit(std::size_t r, const PeriodicSystem& system) const {
  const RunState& run = runs[r];
  const double size = motion(r);
  if (run.harmonic() || !(size > 0.0)) return 0.0;
  double sum = 0.0;
  for (std::size_t j = 0; j < run.readings.size(); ++j) {
    const GridReading& reading = run.readings[j];
    double left = run.data.displacement[j];
    for (int k = 0; k < reading.count; ++k)
      left -= reading.weight[k] * system.observed((reading.base + k) % system.points());
    sum += left * left;
  }
  return std::sqrt(sum / static_cast<double>(run.readings.size())) / size;
}

bool FitData::lost_subharmonic(std::size_t r, const PeriodicSystem& system) const {
  const RunState& run = runs[r];
  return run.data.periods > 1 && !run.harmonic() &&
         subharmonic_share(system, run.data.periods) <
             kMinSubharmonicShare * subharmonic_share(run.data.displacement, run.data.periods) &&
         subharmonic_stands_out(run.data.displacement, run.data.periods);
}

double FitData::worst_misfit(const std::vector<PeriodicSystem>& systems) const {
  double worst = 0.0;
  for (std::size_t r = 0; r < systems.size(); ++r)
    worst = std::max(worst, misfit(r, systems[r]));
  return worst;
}

bool FitData::fitted_badly(const std::vector<PeriodicSystem>& systems) const {
  for (std::size_t r = 0; r < systems.size(); ++r) {
    if (misfit(r, systems[r]) > kFarFromData || lost_subharmonic(r, systems[r])) return true;
  }
  return false;
}

double FitData::squares() const {
  double sum = 0.0;
  for (const RunState& run : runs) {
    for (const double c : run.whitened)
      sum += c * c;
    for (std::size_t j = 0; j < run.data.displacement.size(); ++j) {
      const double sample = run.data.sample_weight.empty() ? 1.0 : run.data.sample_weight[j];
      sum += run.inverse_variance * sample * run.data.displacement[j] * run.data.displacement[j];
    }
  }
  return sum;
}

double FitData::prior_sum(const std::vector<double>& theta) const {
  double sum = 0.0;
  for (const int k : free) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(k)];
    if (!p.prior_mean) continue;
    const double off =
        (theta[static_cast<std::size_t>(k)] - *p.prior_mean) / *p.prior_standard_deviation;
    sum += off * off;
  }
  return sum;
}

double FitData::noise_variance(double sum_of_squares) const {
  if (covariances) return 1.0;
  if (options.noise > 0.0) return options.noise * options.noise;
  const double degrees = static_cast<double>(observations) - static_cast<double>(free.size());
  return degrees > 0.0 ? (sum_of_squares + total_scatter) / degrees
                       : std::numeric_limits<double>::quiet_NaN();
}

void check_run(const RunData& run, std::size_t index) {
  const auto reject = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("run {}: {}", index + 1, why));
  };
  if (!(run.frequency_hz > 0.0) || !std::isfinite(run.frequency_hz))
    reject(fmt::format("the frequency is {} Hz; it must be positive", run.frequency_hz));
  if (!run.harmonics.empty())
    check_harmonics(run, reject);
  else if (run.displacement.size() < 8)
    reject(fmt::format("{} points of displacement are too few; a period needs at least 8",
                       run.displacement.size()));
  if (!run.tau.empty() && run.tau.size() != run.displacement.size())
    reject(fmt::format("{} times for {} displacements", run.tau.size(), run.displacement.size()));
  const auto all_finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  if (!all_finite(run.displacement) || !all_finite(run.tau) || !all_finite(run.excitation))
    reject("a sample is missing or not finite; leave such samples out");
  const auto is_zero = [](double x) { return x == 0.0; };
  if (run.excitation.empty()
          ? is_zero(run.amplitude)
          : run.excitation.size() < 3 || std::ranges::all_of(run.excitation, is_zero))
    reject("the excitation has no amplitude; without motion there is nothing to estimate from");
  if (!run.sample_weight.empty() && run.sample_weight.size() != run.displacement.size())
    reject(fmt::format("{} weights for {} displacements", run.sample_weight.size(),
                       run.displacement.size()));
  for (const double w : run.sample_weight) {
    if (!(w >= 0.0) || !std::isfinite(w))
      reject(fmt::format("a sample has the weight {}; weights are finite and not negative", w));
  }
  if (run.periods < 1) reject(fmt::format("it spans {} excitation periods", run.periods));
  if (!(run.cycles > 0.0) || !(run.weight > 0.0)) reject("cycles and weight must be positive");
}

}  // namespace shaker::estimator
