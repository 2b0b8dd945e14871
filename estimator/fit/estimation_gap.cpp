// Gap of the model: what it leaves of the mean cycles, compared with what their noise explains.
//
// The variance of the residuals (3.28) counts everything that the model cannot follow as noise. The
// scatter of single cycles about their mean does not depend on the model. Both are compared as root
// mean squares over the cycle, which needs no assumption about the spectrum of the noise.
#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include <fmt/format.h>

#include "estimator/fit/internal/estimation_impl.hpp"

namespace shaker::estimator {
namespace {

// Repeated cycles, beyond the first of each run, that a statement needs.
constexpr double kFewestRepeats = 8.0;
constexpr double kTellingRatio = 3.0;  // noise with a slow drift reaches 2
constexpr double kTellingProbability = 1e-3;

double root_mean_square(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values)
    sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// A length as text for the operator: metres become millimetres.
std::string length(double value, const std::string& unit) {
  return unit == "m" ? fmt::format("{:.3g} mm", value * 1e3)
                     : fmt::format("{:.3g} {}", value, unit);
}

// Variance of a point of the mean cycle. Negative if the run has fewer than two cycles.
double mean_cycle_variance(const FitData& all, std::size_t r, const PeriodicSystem& system) {
  const RunData& data = all.runs[r].data;
  const double repeats = data.cycles - 1.0;
  if (!(repeats >= 1.0)) return -1.0;
  const double scatter = data.scatter / (repeats * static_cast<double>(data.displacement.size()));
  // The accelerometer's error moves the simulated cycle about as the excitation moves the measured
  // one.
  const double motion = all.motion(r), excitation = root_mean_square(system.excitation());
  const double excited =
      excitation > 0.0 ? motion / (excitation * std::numbers::sqrt2) * data.excitation_error : 0.0;
  return scatter / data.cycles + excited * excited;
}

}  // namespace

ModelGap Estimator::Impl::model_gap() const {
  ModelGap gap;
  if (data.covariances || fit.status == FitStatus::no_solution) return gap;
  double sum = 0.0, noise = 0.0, points = 0.0, repeats = 0.0, worst = 0.0;
  for (std::size_t r = 0; r < data.runs.size(); ++r) {
    const double variance = mean_cycle_variance(data, r, solutions.systems[r]);
    if (variance < 0.0) continue;
    const auto count = static_cast<double>(data.runs[r].count());
    const double left = data.misfit(r, solutions.systems[r]) * data.motion(r);
    sum += count * left * left;
    noise += count * variance;
    points += count;
    repeats += data.runs[r].data.cycles - 1.0;
    if (left * left > worst * variance) {
      worst = left * left / variance;
      gap.worst_run = static_cast<int>(r);
    }
  }
  if (repeats < kFewestRepeats || !(noise > 0.0)) return gap;
  gap.size = std::sqrt(sum / points);
  gap.noise_floor = std::sqrt(noise / points);
  return gap;
}

std::vector<std::string> Estimator::Impl::gap_warnings(const ModelGap& gap) const {
  constexpr auto kRemedy =
      "the model lacks something, or a sensor is not what it should be, and the intervals do not "
      "count that; shakerctl diagnose looks for it";
  if (gap.size > kTellingRatio * gap.noise_floor)
    return {fmt::format(
        "the model misses the mean cycles by {}, {:.0f} times what their scatter explains "
        "({}), the most in run {} ({:g} Hz): {}",
        length(gap.size, data.model.length_unit()), gap.size / gap.noise_floor,
        length(gap.noise_floor, data.model.length_unit()), gap.worst_run + 1,
        data.runs[static_cast<std::size_t>(gap.worst_run)].data.frequency_hz, kRemedy)};
  if (fit.lack_of_fit < kTellingProbability)
    return {fmt::format(
        "noise alone would leave residuals as large as these with a probability of {:.1g}: {}",
        fit.lack_of_fit, kRemedy)};
  return {};
}

}  // namespace shaker::estimator
