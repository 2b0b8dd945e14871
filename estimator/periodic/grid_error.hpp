// How far the finest of three grids still is from the exact solution, by how quickly solutions on
// finer and finer grids come together.
//
// With an error C n^-p the differences of three grids n1 < n2 < n3 are in the ratio
//     (n1^-p - n2^-p) / (n2^-p - n3^-p),
// which tells p; but no more is believed than the grid is trusted with, and what looks like less
// than first order is taken for first order.
#pragma once

#include <cmath>
#include <limits>

#include "estimator/model.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

// The order that a grid may be trusted with. An uncorrected kink leaves the sensitivities the
// second, but by fits and starts, as zeros of the velocity pass grid points: the last difference
// itself is then as good as an estimate gets.
inline int trusted_order(const Model& model, const GridOptions& grid) {
  const bool corrected =
      grid.correct_kink && grid.scheme != Scheme::fourier && model.coordinates() == 1;
  if (model.has_velocity_kink() && !corrected) return 1;
  return grid.scheme == Scheme::order2 ? 2 : grid.scheme == Scheme::order4 ? 4 : 6;
}

struct GridDifference {
  double points = 0.0;  // of the finer grid
  double size = 0.0;    // of its solution less that of the coarser one
};

inline constexpr double kSlack = 1.001;  // for rounding in what is exactly of an order

// `coarsest`: points of the first grid. Grids that do not come together at all have an infinite
// error.
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
