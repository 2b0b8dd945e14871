#include "estimator/fit/run_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

// Standard errors are those of noise alone: a difference that matters is also one of size.
constexpr double kSurelyApart = 8.0;   // in standard errors of the difference
constexpr double kApartInSize = 0.01;  // relative

double standard_deviation_of(const std::vector<double>& y) {
  double mean = 0.0, sum = 0.0;
  for (const double value : y)
    mean += value / static_cast<double>(y.size());
  for (const double value : y)
    sum += (value - mean) * (value - mean) / static_cast<double>(y.size());
  return std::sqrt(sum);
}

}  // namespace

std::optional<std::size_t> weigh_by_scatter(std::vector<RunData>& runs) {
  std::vector<double> variance;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const double degrees =
        static_cast<double>(runs[r].displacement.size()) * (runs[r].cycles - 1.0);
    if (!(degrees > 0.0) || !(runs[r].scatter > 0.0) || !runs[r].tau.empty()) return r;
    variance.push_back(runs[r].scatter / degrees);
  }
  for (std::size_t r = 0; r < runs.size(); ++r)
    runs[r].weight = variance.front() / variance[r];
  return std::nullopt;
}

std::string unit_doubt(const Model& model, const RunData& run) {
  constexpr double kFar = 50.0;
  if (run.displacement.empty() || run.periods > 1) return {};
  PeriodicSystem system(run.model_or(model), {Scheme::order4, 160, false});
  if (run.excitation.empty())
    system.set_excitation(run.frequency_hz, run.amplitude);
  else
    system.set_excitation(run.frequency_hz, run.excitation, 8);
  if (system.solve_from_rest(model.start()).status != SolveStatus::converged) return {};
  std::vector<double> y;
  for (int i = 0; i < system.points(); ++i)
    y.push_back(system.value(i, model.observed()));
  const double expected = standard_deviation_of(y),
               measured = standard_deviation_of(run.displacement);
  if (!std::isfinite(measured) || !(expected > 0.0) ||
      (measured < kFar * expected && measured > expected / kFar))
    return {};
  return fmt::format(
      "the measured displacement moves by {:.3g} (standard deviation), the model at its start "
      "values by "
      "{:.3g} {}: do the units match? The model wants {} and {}/s^2",
      measured, expected, model.length_unit(), model.length_unit(), model.length_unit());
}

MotionOfRuns motion_of_runs(const Estimator& fitted, const Model& model) {
  MotionOfRuns motion{0.0, -std::numeric_limits<double>::infinity()};
  for (const PeriodicSystem& system : fitted.solutions()) {
    const int n = system.points(), c = model.observed();
    for (int i = 0; i < n; ++i) {
      const double next = system.value((i + 1) % n, c), last = system.value((i + n - 1) % n, c);
      motion.fastest =
          std::max(motion.fastest, std::fabs(next - last) * 0.5 * n * system.frequency());
      motion.deepest = std::max(motion.deepest, system.value(i, c));
    }
  }
  return motion;
}

std::vector<ParameterAlone> estimated_alone(const Model& model, std::vector<RunData> runs) {
  Estimator estimator(model, std::move(runs));
  const Fit& fit = estimator.fit(model.start());
  std::vector<ParameterAlone> found;
  if (fit.status != FitStatus::converged) return found;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    if (!model.parameters()[k].fixed && fit.standard_error[k] > 0.0)
      found.push_back({model.parameters()[k].name, fit.theta[k], fit.standard_error[k]});
  }
  return found;
}

std::optional<std::size_t> disagreement(const std::vector<ParameterAlone>& one,
                                        const std::vector<ParameterAlone>& other) {
  const auto same = [](const ParameterAlone& a, const ParameterAlone& b) {
    return a.name == b.name;
  };
  if (!std::equal(one.begin(), one.end(), other.begin(), other.end(), same)) return std::nullopt;
  std::optional<std::size_t> worst;
  double most = kSurelyApart;
  for (std::size_t k = 0; k < one.size(); ++k) {
    const double off = std::fabs(other[k].value - one[k].value);
    const double apart = off / std::hypot(other[k].standard_error, one[k].standard_error);
    if (apart < most || off < kApartInSize * std::fabs(one[k].value)) continue;
    most = apart;
    worst = k;
  }
  return worst;
}

}  // namespace shaker::estimator
