// Multiple shooting: the starts of a record's arcs, condensed onto the record's first state and the
// free parameters. What solves the least squares moves those, and every arc follows so that the
// ends of arcs meet the next ones' starts (H. G. Bock, 1983).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "estimator/solve/time/integration.hpp"

namespace shaker::estimator {

// An arc's last state, and its derivatives: states x columns, row by row.
struct ArcEnd {
  const double *state, *derivatives;
};

class Shooting {
 public:
  using Rows =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

  // `columns`: states, then free parameters.
  Shooting(std::size_t states, std::size_t columns) : m_(states), k_(columns) {}

  // Of one record, an end for each arc. A share `closing` of each gap between an arc's end and the
  // next one's start is to be closed.
  void condense(std::span<const Arc> arcs, std::span<const ArcEnd> ends, double closing);

  std::size_t arcs() const { return moves_.size() / (m_ * (k_ + 1)); }
  // How the arcs' starts move, one below the other: states x (columns + 1) each. The last column is
  // what a start moves by itself to close the gaps before it, with a minus.
  Rows moves() const;
  // A number at a node of an arc whose derivatives over (the arc's start, parameters) are `own`: the
  // same over (first state, parameters), and what closing takes from the number.
  Eigen::RowVectorXd row(std::size_t arc, const double* own) const;
  // End less next start, states of each arc but the last.
  const std::vector<double>& gaps() const { return gaps_; }

  // Adds the products of all the record's rows over (first state, parameters, residual less what
  // closing explains), in full, row by row.
  void add_products(const ArcSums& sums, std::size_t first, std::vector<double>& total) const;

 private:
  std::size_t m_, k_;
  std::vector<double> moves_, gaps_;
};

// Adds `moves` of the starts, one below the other.
void move_starts(std::span<Arc> arcs, const Eigen::VectorXd& moves);

}  // namespace shaker::estimator
