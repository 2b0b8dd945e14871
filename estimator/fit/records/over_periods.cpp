#include "estimator/fit/records/over_periods.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include <fmt/format.h>

#include "estimator/fit/records/transient.hpp"
#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kSegmentsInPeriod = 4;
constexpr std::size_t kFewestSamples = 8;  // in a segment, which must determine its initial state

// Converts a run to a record. The first sample is repeated after the last one.
TransientRecord record_of(const RunData& run) {
  const std::size_t n = run.displacement.size();
  const double span = static_cast<double>(run.periods) / run.frequency_hz;
  TransientRecord record;
  record.weight = run.cycles * run.weight;
  for (std::size_t i = 0; i <= n; ++i) {
    const double whole = i < n ? 0.0 : 1.0;
    const double tau =
        run.tau.empty() ? static_cast<double>(i % n) / static_cast<double>(n) : run.tau[i % n];
    record.t.push_back((tau + whole) * span);
    record.displacement.push_back(run.displacement[i % n]);
  }
  if (run.excitation.empty()) {
    record.excitation = Excitation::cosine(run.amplitude, run.frequency_hz);
    return record;
  }
  const std::size_t m = run.excitation.size();
  std::vector<double> t, x;
  for (std::size_t i = 0; i <= 2 * m; ++i) {  // two rounds, because tau may begin anywhere
    t.push_back(static_cast<double>(i) / static_cast<double>(m) * span);
    x.push_back(run.excitation[i % m]);
  }
  record.excitation = Excitation::sampled(t, x);
  return record;
}

// A parameter that is 0 at the start hides its effect; such a parameter gets the value 0.1.
std::vector<double> away_from_zero(const Model& model) {
  std::vector<double> theta = model.start();
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
    if (theta[k] == 0.0 && !p.fixed) theta[k] = std::clamp(0.1, p.lower, p.upper);
  }
  return theta;
}

// True when the response to a cosine is a cosine of the same frequency: then the model is
// linear.
bool is_linear(const Model& model, const RunData& run) {
  constexpr int kPoints = 160;
  constexpr double kRounding = 1e-8;
  double amplitude = run.amplitude;
  for (const double x : run.excitation)
    amplitude = std::max(amplitude, std::fabs(x));
  PeriodicSystem system(run.model_or(model), {Scheme::order6, kPoints, true});
  system.set_excitation(run.frequency_hz, amplitude);
  if (system.solve_from_rest(away_from_zero(model)).status != SolveStatus::converged) return false;
  std::vector<double> response;
  double mean = 0.0, square = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double u = system.value(i, model.observed());
    response.push_back(u);
    mean += u / kPoints;
    square += u * u / kPoints;
  }
  const double moved = square - mean * mean,
               of_first = 0.5 * std::norm(fourier_sum(response, 1, 2.0 / kPoints));
  return of_first > 0.0 && std::fabs(moved - of_first) < kRounding * of_first;
}

struct FitWorth {
  bool solved = false, usable = false, spotless = false;
  double sum_of_squares = 0.0;
};

FitWorth worth_of(RefinedFit& fitted, const Fit& fit) {
  if (fit.status == FitStatus::no_solution) return {};
  const Estimate estimate = fitted.describe();
  return {true, estimate.usable, estimate.usable && estimate.warnings.empty(), fit.sum_of_squares};
}

bool better(const FitWorth& a, const FitWorth& b) {
  if (a.solved != b.solved) return a.solved;
  if (a.usable != b.usable) return a.usable;
  return a.sum_of_squares < b.sum_of_squares;
}

}  // namespace

std::optional<std::vector<double>> start_over_periods(const Model& model,
                                                      const std::vector<RunData>& runs,
                                                      const std::vector<double>& start) {
  std::vector<TransientRecord> records;
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  for (const RunData& run : runs) {
    if (run.displacement.empty()) return std::nullopt;
    records.push_back(record_of(run));
    const std::size_t period = run.displacement.size() / static_cast<std::size_t>(run.periods);
    options.segment = std::max({options.segment, period / kSegmentsInPeriod, kFewestSamples});
  }
  TransientEstimator segments(model, std::move(records), options);
  const TransientFit& fit = segments.fit(start);
  if (fit.status != FitStatus::converged) return std::nullopt;
  return fit.theta;
}

bool over_periods(const std::vector<RunData>& runs) {
  return std::any_of(runs.begin(), runs.end(), [](const RunData& run) { return run.periods > 1; });
}

std::string cannot_repeat_later(const Model& model, const std::vector<RunData>& runs) {
  const auto run =
      std::find_if(runs.begin(), runs.end(), [](const RunData& each) { return each.periods > 1; });
  if (run == runs.end() || !is_linear(model, *run)) return {};
  return fmt::format(
      "the model \"{}\" is linear: its response repeats with every period of the excitation, "
      "whatever its parameters, and never only after {}; take a model with an effect that is not "
      "linear",
      model.name(), run->periods);
}

const Fit& fit_over_periods(RefinedFit& fitted, const Model& model,
                            const std::vector<RunData>& runs, const std::vector<double>& start) {
  const Fit& direct = fitted.fit(start);
  const FitWorth first = worth_of(fitted, direct);
  if (first.spotless) return direct;
  const auto from_record = start_over_periods(model, runs, start);
  if (!from_record) return direct;
  const Fit& second = fitted.fit(*from_record);
  return better(first, worth_of(fitted, second)) ? fitted.fit(start) : second;
}

}  // namespace shaker::estimator
