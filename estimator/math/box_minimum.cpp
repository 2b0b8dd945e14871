#include "estimator/math/box_minimum.hpp"

#include <vector>

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kMostRounds = 20;   // a variable: many times what was ever needed
constexpr double kNoSlope = 1e-12;  // of the slope at 0

enum class Held { no, low, high };

// With the others where they are.
VectorXd minimum_of_free(const MatrixXd& a, const VectorXd& b, const VectorXd& x,
                         const std::vector<Index>& free) {
  const auto n = static_cast<Index>(free.size());
  const VectorXd slope = b - a * x;
  MatrixXd part(n, n);
  VectorXd right(n);
  for (Index i = 0; i < n; ++i) {
    right[i] = slope[free[static_cast<std::size_t>(i)]];
    for (Index j = 0; j < n; ++j)
      part(i, j) = a(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]);
  }
  const VectorXd step = part.ldlt().solve(right);
  VectorXd target = x;
  for (Index i = 0; i < n; ++i)
    target[free[static_cast<std::size_t>(i)]] += step[i];
  return target;
}

}  // namespace

VectorXd box_minimum(const MatrixXd& a, const VectorXd& b, const VectorXd& lower,
                     const VectorXd& upper) {
  const Index n = b.size();
  VectorXd x = VectorXd::Zero(n);
  std::vector<Held> held(static_cast<std::size_t>(n), Held::no);
  for (Index round = 0; round < kMostRounds * (n + 1); ++round) {
    std::vector<Index> free;
    for (Index k = 0; k < n; ++k) {
      if (held[static_cast<std::size_t>(k)] == Held::no) free.push_back(k);
    }
    const VectorXd target = minimum_of_free(a, b, x, free);
    double share = 1.0;
    Index first = -1;
    for (const Index k : free) {
      if (target[k] >= lower[k] && target[k] <= upper[k]) continue;
      const double bound = target[k] < lower[k] ? lower[k] : upper[k];
      const double own = (bound - x[k]) / (target[k] - x[k]);
      if (own >= share) continue;
      share = own;
      first = k;
    }
    x += share * (target - x);
    if (first >= 0) {
      const bool low = target[first] < lower[first];
      x[first] = low ? lower[first] : upper[first];
      held[static_cast<std::size_t>(first)] = low ? Held::low : Held::high;
      continue;
    }
    const VectorXd slope = b - a * x;
    double steepest = kNoSlope * b.cwiseAbs().maxCoeff();
    Index inwards = -1;
    for (Index k = 0; k < n; ++k) {
      const Held how = held[static_cast<std::size_t>(k)];
      const double inward = how == Held::low ? slope[k] : how == Held::high ? -slope[k] : 0.0;
      if (inward <= steepest) continue;
      steepest = inward;
      inwards = k;
    }
    if (inwards < 0) break;
    held[static_cast<std::size_t>(inwards)] = Held::no;
  }
  return x;
}

}  // namespace shaker::estimator
