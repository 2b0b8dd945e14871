#include "estimator/math/accelerated_course.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-10;    // of the changes' largest square: those are dependent
constexpr double kMostStretch = 30.0;  // of a step

// A column in front of at most `most - 1` others.
void put_first(MatrixXd& columns, const VectorXd& column, Index most) {
  const Index kept = std::min(columns.cols(), most - 1);
  MatrixXd all(column.size(), kept + 1);
  all.col(0) = column;
  if (kept > 0) all.rightCols(kept) = columns.leftCols(kept);
  columns = std::move(all);
}

}  // namespace

void AcceleratedCourse::forget() {
  step_.resize(0);
  changes_.resize(0, 0);
  ways_.resize(0, 0);
}

VectorXd AcceleratedCourse::next(const VectorXd& step, const MatrixXd& weight, bool straight) {
  if (!straight) {
    forget();
    return step;
  }
  if (step_.size() > 0) {
    put_first(changes_, step - step_, step.size());
    put_first(ways_, taken_, step.size());
  }
  VectorXd taken = step;
  if (changes_.cols() > 0) {
    MatrixXd normal = changes_.transpose() * weight * changes_;
    normal.diagonal().array() += kRounding * normal.diagonal().maxCoeff();
    const VectorXd product = changes_.transpose() * (weight * step);
    const VectorXd further = step - (ways_ + changes_) * Ldlt(normal).solve(product);
    const double most = kMostStretch * kMostStretch * step.dot(weight * step);
    if (further.dot(weight * further) <= most)
      taken = further;
    else
      forget();
  }
  step_ = step;
  taken_ = taken;
  return taken;
}

}  // namespace shaker::estimator
