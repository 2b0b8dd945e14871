#include "estimator/fit/run_comparison.hpp"

#include <cmath>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

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

}  // namespace shaker::estimator
