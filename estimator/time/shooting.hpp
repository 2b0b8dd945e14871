// Multiple shooting: the starts of a record's arcs, condensed onto the record's first state and the
// free parameters. What solves the least squares moves those, and every arc follows so that the
// ends of arcs meet the next ones' starts (H. G. Bock, 1983).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "estimator/time/integration.hpp"

namespace shaker::estimator {

class Shooting {
 public:
  using Rows =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

  // `columns`: states, then free parameters.
  Shooting(std::size_t states, std::size_t columns) : m_(states), k_(columns) {}

  // Of arcs `first` to `first + count - 1`, one record. A share `closing` of each gap between an
  // arc's end and the next one's start is to be closed.
  void condense(std::span<const Arc> arcs, const ArcSums& sums, std::size_t first,
                std::size_t count, double closing);

  std::size_t arcs() const { return moves_.size() / (m_ * (k_ + 1)); }
  // How an arc's start moves: states x (columns + 1). The last column is what it moves by itself to
  // close the gaps before it, with a minus. `arc` counts from `first`.
  Rows move(std::size_t arc) const;
  // By `step` of the record's first state and of the parameters, and by itself; adds to `start`.
  void follow(std::size_t arc, std::span<const double> step, std::vector<double>& start) const;
  // End less next start, states of each arc but the last.
  const std::vector<double>& gaps() const { return gaps_; }

  // Adds the products of all the record's rows over (first state, parameters, residual less what
  // closing explains), in full, row by row.
  void add_products(const ArcSums& sums, std::size_t first, std::vector<double>& total) const;

 private:
  std::size_t m_, k_;
  std::vector<double> moves_, gaps_;
};

}  // namespace shaker::estimator
