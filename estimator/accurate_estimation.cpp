#include "estimator/accurate_estimation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/periodic/grid_error.hpp"

namespace shaker::estimator {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Of a level's iteration: well below what its grid is worth, and on the finest below what is asked.
double tolerance(std::size_t level, double accuracy) {
  return std::max(0.1 * accuracy, 1e-5 * std::pow(0.003, static_cast<double>(level)));
}

// 1, 2, 4, 6, 8, 12, 16, 24, ...
int multiple(std::size_t level) {
  if (level < 2) return 1 << level;
  return level % 2 == 0 ? 2 << level / 2 : 3 << (level - 1) / 2;
}

}  // namespace

AccurateEstimator::AccurateEstimator(const Model& model, std::vector<RunData> runs,
                                     AccurateOptions options)
    : model_(&model), runs_(std::move(runs)), options_(options) {
  level(0);
}

Estimator& AccurateEstimator::level(std::size_t index) {
  while (levels_.size() <= index) {
    EstimationOptions each = options_.estimation;
    each.tolerance = tolerance(levels_.size(), options_.accuracy);
    if (!levels_.empty())
      each.grid.points = levels_.front()->solutions().front().points() * multiple(levels_.size());
    levels_.push_back(std::make_unique<Estimator>(*model_, runs_, each));
  }
  return *levels_[index];
}

double AccurateEstimator::change(const std::vector<double>& from,
                                 const std::vector<double>& to) const {
  double worst = 0.0;
  for (std::size_t k = 0; k < to.size(); ++k)
    worst = std::max(worst, std::fabs(to[k] - from[k]) / std::max(std::fabs(to[k]), 1e-12));
  return worst;
}

const Fit& AccurateEstimator::fit(const std::vector<double>& start) {
  at_ = 0;
  error_ = kInfinite;
  level(0).fit(start);
  GridDifference before{0.0, kInfinite};
  double coarsest = 0.0;
  while (finest().last().status == FitStatus::converged) {
    const double points = this->points();
    if (levels_.front()->solutions().front().points() * multiple(at_ + 1) > options_.most_points)
      break;
    Estimator& fine = level(at_ + 1);
    fine.start_from(finest());
    const Fit& next = fine.fit(finest().last().theta, true);
    if (next.status != FitStatus::converged) break;
    const GridDifference last{static_cast<double>(fine.solutions().front().points()),
                              change(finest().last().theta, next.theta)};
    ++at_;
    if (at_ > 1)
      error_ =
          error_on_finest(trusted_order(*model_, options_.estimation.grid), coarsest, before, last);
    if (reached()) break;
    coarsest = points;
    before = last;
  }
  return finest().last();
}

}  // namespace shaker::estimator
