#include "cli/over_periods_fit.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <fmt/format.h>

#include "estimator/time/over_periods.hpp"

namespace shaker::cli {
namespace {

using estimator::RunData;

// A parameter that is 0 at the start hides its effect; such a parameter gets the value 0.1.
std::vector<double> away_from_zero(const estimator::Model& model) {
  std::vector<double> theta = model.start();
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const estimator::ModelParameter& p = model.parameters()[k];
    if (theta[k] == 0.0 && !p.fixed) theta[k] = std::clamp(0.1, p.lower, p.upper);
  }
  return theta;
}

// True when the response to a cosine is a cosine of the same frequency: then the model is
// linear.
bool is_linear(const estimator::Model& model, const RunData& run) {
  constexpr int kPoints = 160;
  constexpr double kRounding = 1e-8;
  double amplitude = run.amplitude;
  for (const double x : run.excitation)
    amplitude = std::max(amplitude, std::fabs(x));
  estimator::PeriodicSystem system(run.model_or(model), {estimator::Scheme::order6, kPoints, true});
  system.set_excitation(run.frequency_hz, amplitude);
  if (system.solve_from_rest(away_from_zero(model)).status != estimator::SolveStatus::converged)
    return false;
  std::complex<double> first = 0.0;
  double mean = 0.0, square = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double u = system.value(i, model.observed());
    first += u * std::polar(2.0 / kPoints, -2.0 * std::numbers::pi * i / kPoints);
    mean += u / kPoints;
    square += u * u / kPoints;
  }
  const double moved = square - mean * mean, of_first = 0.5 * std::norm(first);
  return of_first > 0.0 && std::fabs(moved - of_first) < kRounding * of_first;
}

struct Worth {
  bool solved = false, usable = false, spotless = false;
  double sum_of_squares = 0.0;
};

Worth worth(RefinedFit& fitted, const estimator::Fit& fit) {
  if (fit.status == estimator::FitStatus::no_solution) return {};
  const estimator::Estimate estimate = fitted.describe();
  return {true, estimate.usable, estimate.usable && estimate.warnings.empty(), fit.sum_of_squares};
}

bool better(const Worth& a, const Worth& b) {
  if (a.solved != b.solved) return a.solved;
  if (a.usable != b.usable) return a.usable;
  return a.sum_of_squares < b.sum_of_squares;
}

}  // namespace

bool over_periods(const std::vector<RunData>& runs) {
  return std::any_of(runs.begin(), runs.end(), [](const RunData& run) { return run.periods > 1; });
}

std::string cannot_repeat_later(const estimator::Model& model, const std::vector<RunData>& runs) {
  const auto run =
      std::find_if(runs.begin(), runs.end(), [](const RunData& each) { return each.periods > 1; });
  if (run == runs.end() || !is_linear(model, *run)) return {};
  return fmt::format(
      "the model \"{}\" is linear: its response repeats with every period of the excitation, "
      "whatever its parameters, and never only after {}; take a model with an effect that is not "
      "linear",
      model.name(), run->periods);
}

const estimator::Fit& fit_over_periods(RefinedFit& fitted, const estimator::Model& model,
                                       const std::vector<RunData>& runs,
                                       const std::vector<double>& start) {
  const estimator::Fit& direct = fitted.fit(start);
  const Worth first = worth(fitted, direct);
  if (first.spotless) return direct;
  const auto from_record = estimator::start_over_periods(model, runs, start);
  if (!from_record) return direct;
  const estimator::Fit& second = fitted.fit(*from_record);
  return better(first, worth(fitted, second)) ? fitted.fit(start) : second;
}

}  // namespace shaker::cli
