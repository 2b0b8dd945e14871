// Error estimate of the finest of three grids, from the differences between the solutions
// (Richardson extrapolation with an observed order).
//
// With an error C n^-p the differences of three grids n1 < n2 < n3 are in the ratio
//     (n1^-p - n2^-p) / (n2^-p - n3^-p),
// which gives the observed order p. It is limited to the interval from 1 to the trusted order of
// the grid.
#pragma once

#include <cmath>
#include <limits>

#include "estimator/model/model.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

// The highest order that the error estimate may assume. With an uncorrected kink the sensitivities
// are of second order, but irregularly, because zeros of the velocity pass grid points. The order
// is then taken as 1, which makes the last difference itself the estimate.
inline int trusted_order(const Model& model, const GridOptions& grid) {
  const bool corrected =
      grid.correct_reversals && grid.scheme != Scheme::fourier && model.coordinates() == 1;
  if (model.has_velocity_kink() && !corrected) return 1;
  return grid.scheme == Scheme::order2 ? 2 : grid.scheme == Scheme::order4 ? 4 : 6;
}

struct GridDifference {
  double points = 0.0;  // of the finer grid
  double size = 0.0;    // of the difference between its solution and that of the coarser one
};

inline constexpr double kSlack = 1.001;  // rounding allowance for an exact order

// Returns the estimated error of the finest grid. `coarsest`: points of the first grid. The error
// is infinite if the differences do not shrink.
inline double error_on_finest(int trusted, double coarsest, const GridDifference& before,
                              const GridDifference& last) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  if (last.size == 0.0) return 0.0;
  const double first = coarsest / before.points;
  const double second = before.points / last.points;
  if (!(last.size < before.size)) return kInfinite;
  const auto shown = [&](double order) {
    const double ratio = (std::pow(first, -order) - 1.0) / (1.0 - std::pow(second, order));
    return ratio <= kSlack * before.size / last.size;
  };
  double order = trusted;
  if (!shown(order)) {
    double too_high = order;
    order = 1.0;
    for (int halving = 0; halving < 10; ++halving) {
      const double middle = 0.5 * (order + too_high);
      (shown(middle) ? order : too_high) = middle;
    }
  }
  return last.size / (std::pow(second, -order) - 1.0);
}

}  // namespace shaker::estimator
