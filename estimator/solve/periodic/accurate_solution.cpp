#include "estimator/solve/periodic/internal/accurate_solution.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/solve/periodic/grid_error.hpp"

namespace shaker::estimator {
namespace {

constexpr int kMaxNewtonSteps = 12;
constexpr double kUnboundedError = std::numeric_limits<double>::infinity();
// Residual tolerance of the first two grids, as a share of the excitation or of the largest
// acceleration. They only serve the comparison with each other, which is not more accurate.
constexpr double kCoarseGrids = 1e-5;

}  // namespace

AccurateSolution::AccurateSolution(const Model& model, AccuracyOptions options)
    : model_(&model), options_(options) {
  const auto width = static_cast<std::size_t>(1 + model.parameter_count());
  largest_.resize(width);
  difference_.resize(width);
  level(0);
}

PeriodicSystem& AccurateSolution::level(std::size_t index) {
  while (levels_.size() <= index) {
    GridOptions grid = options_.grid;
    grid.points <<= levels_.size();
    levels_.push_back(std::make_unique<PeriodicSystem>(*model_, grid));
    excited_.push_back(0);
  }
  if (excited_[index] == 0) levels_[index]->set_excitation(frequency_, amplitude_);
  excited_[index] = 1;
  return *levels_[index];
}

void AccurateSolution::set_excitation(double frequency_hz, double amplitude) {
  frequency_ = frequency_hz;
  amplitude_ = amplitude;
  std::fill(excited_.begin(), excited_.end(), 0);
}

// Largest differences at the common points of both grids, relative to the largest values.
AccurateSolution::Change AccurateSolution::change(const PeriodicSystem& coarse,
                                                  const PeriodicSystem& fine) const {
  const int s = model_->coordinates();
  const std::size_t width = largest_.size();
  Change out;
  for (int c = 0; c < s; ++c) {
    std::fill(largest_.begin(), largest_.end(), 1e-300);
    std::fill(difference_.begin(), difference_.end(), 0.0);
    for (int i = 0; i < coarse.points(); ++i) {
      const double* one = coarse.row(i, c).data();
      const double* other = fine.row(2 * i, c).data();
      const double z = fine.value(2 * i, c);
      largest_[0] = std::max(largest_[0], std::fabs(z));
      difference_[0] = std::max(difference_[0], std::fabs(z - coarse.value(i, c)));
      for (std::size_t k = 1; k < width; ++k) {
        largest_[k] = std::max(largest_[k], std::fabs(other[k]));
        difference_[k] = std::max(difference_[k], std::fabs(other[k] - one[k]));
      }
    }
    out.state = std::max(out.state, difference_[0] / largest_[0]);
    for (std::size_t k = 1; k < width; ++k)
      out.sensitivities = std::max(out.sensitivities, difference_[k] / largest_[k]);
  }
  return out;
}

AccuracyReport AccurateSolution::solve(std::span<const double> theta, double accuracy) {
  AccuracyReport report;
  finest_ = 0;
  report.solve = level(0).solve_from_rest(
      theta, std::max(PeriodicSystem::kTolerance, kCoarseGrids * std::fabs(amplitude_)));
  report.points = level(0).points();
  report.state_error = report.sensitivity_error = kUnboundedError;
  const int order = trusted_order(*model_, options_.grid);
  Change before{kUnboundedError, kUnboundedError};
  for (std::size_t at = 1; report.solve.status == SolveStatus::converged; ++at) {
    if (2 * report.points > options_.most_points) break;
    PeriodicSystem& fine = level(at);
    const PeriodicSystem& coarse = *levels_[at - 1];
    fine.interpolate_from(coarse);
    // The comparison needs no smaller residual than this; a residual scales as an acceleration.
    constexpr double kSquareOfTwoPi = 39.5;
    const double size = 1e-3 + std::fabs(fine.value(0, 0));
    const double scale = kSquareOfTwoPi * fine.frequency() * fine.frequency() * size;
    const double tolerance = std::max(0.1 * accuracy, at == 1 ? kCoarseGrids : 0.0);
    const SolveReport solved = fine.solve(theta, kMaxNewtonSteps, tolerance * scale);
    report.solve.iterations += solved.iterations;
    if (solved.status != SolveStatus::converged) break;
    finest_ = at;
    report.points = fine.points();
    const Change now = change(coarse, fine);
    const double points = report.points;
    const auto error = [&](double last, double previous) {
      return error_on_finest(order, points / 4.0, {points / 2.0, previous}, {points, last});
    };
    report.state_error = error(now.state, before.state);
    report.sensitivity_error = error(now.sensitivities, before.sensitivities);
    before = now;
    report.reached = at > 1 && std::max(report.state_error, report.sensitivity_error) <= accuracy;
    if (report.reached) break;
  }
  // No finer grid has a solution: the first one is solved to the full tolerance.
  if (finest_ == 0 && report.solve.status == SolveStatus::converged) {
    const int steps = report.solve.iterations;
    report.solve = level(0).solve(theta, kMaxNewtonSteps, PeriodicSystem::kTolerance);
    report.solve.iterations += steps;
  }
  return report;
}

}  // namespace shaker::estimator
