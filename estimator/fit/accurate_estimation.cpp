#include "estimator/fit/internal/accurate_estimation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/solve/periodic/grid_error.hpp"

namespace shaker::estimator {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Shares of the required accuracy for the iteration and for the grid.
constexpr double kIteration = 0.1;
constexpr double kGrid = 0.5;
constexpr int kMostAtOnce = 4;  // greatest refinement from one grid to the next

// Tolerance of the iteration on a grid. It is well below the error of the grid, which falls
// with the sixth power of the points from about 1e-4 on the first grid. On the finest grid it
// is below the required accuracy.
double tolerance(int multiple, double accuracy) {
  return std::max(kIteration * accuracy, 3e-6 * std::pow(multiple, -6.0));
}

}  // namespace

AccurateEstimator::AccurateEstimator(const Model& model, std::vector<RunData> runs,
                                     AccurateOptions options)
    : model_(&model), runs_(std::move(runs)), options_(options) {
  level(1);
}

std::size_t AccurateEstimator::level(int multiple) {
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    if (levels_[i].multiple == multiple) return i;
  }
  EstimationOptions each = options_.estimation;
  each.tolerance = tolerance(multiple, options_.accuracy);
  if (!levels_.empty())
    each.grid.points = multiple * levels_.front().estimator->solutions().front().points();
  levels_.push_back({multiple, std::make_unique<Estimator>(*model_, runs_, each)});
  return levels_.size() - 1;
}

// The next grid as a multiple of the first: the points that the required accuracy needs,
// predicted from the last change of theta between two grids with this ratio of points.
int AccurateEstimator::next_multiple(double change, double ratio) const {
  const int now = levels_[at_].multiple;
  if (std::isinf(change)) return 2 * now;
  const int order = trusted_order(*model_, options_.estimation.grid);
  const double error = change / (std::pow(ratio, order) - 1.0);
  const double finer = std::pow(error / (kGrid * options_.accuracy), 1.0 / order);
  return static_cast<int>(std::ceil(now * std::clamp(finer, 1.2, 1.0 * kMostAtOnce)));
}

double AccurateEstimator::change(const std::vector<double>& from,
                                 const std::vector<double>& to) const {
  double worst = 0.0;
  for (std::size_t k = 0; k < to.size(); ++k)
    worst = std::max(worst, std::fabs(to[k] - from[k]) / std::max(std::fabs(to[k]), 1e-12));
  return worst;
}

const Fit& AccurateEstimator::fit(const std::vector<double>& start) {
  error_ = kInfinite;
  at_ = level(1);
  finest().fit(start);
  const int least = ring();
  const int order = trusted_order(*model_, options_.estimation.grid);
  double coarsest = 0.0;
  double before = least;  // points of the grid before the finest
  GridDifference last{1.0 * least, kInfinite};
  while (finest().last().status == FitStatus::converged) {
    const int multiple = next_multiple(last.size, last.points / before);
    if (multiple * least > options_.most_points) break;
    const std::size_t next = level(multiple);
    Estimator& fine = *levels_[next].estimator;
    fine.start_from(finest());
    if (fine.fit(finest().last().theta, true).status != FitStatus::converged) break;
    const GridDifference now{1.0 * fine.solutions().front().points(),
                             change(finest().last().theta, fine.last().theta)};
    if (std::isfinite(last.size)) error_ = error_on_finest(order, coarsest, last, now);
    at_ = next;
    if (reached()) break;
    coarsest = before = last.points;
    last = now;
  }
  return finest().last();
}

}  // namespace shaker::estimator
