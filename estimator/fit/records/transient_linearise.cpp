// The least squares (5.8) linearised at the present point: R and Q^T r, gaps, squares.
#include <algorithm>
#include <cmath>

#include "estimator/fit/records/internal/transient_impl.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

constexpr double kGapWeight = 10.0;  // of a gap in the merit, relative to its segment's residuals
constexpr double kPositive = 1e-10;  // least pivot of products over unit squares; rows otherwise

}  // namespace

IntegrationReport TransientEstimator::Impl::integrate(const Level& level) {
  kept = false;
  return integration->sums(arcs, fit.theta, level.sums, sums);
}

// The trajectory at the present point, which sums leave out.
void TransientEstimator::Impl::keep() {
  if (kept) return;
  integration->run(arcs, fit.theta, true);
  kept = true;
}

int TransientEstimator::Impl::unknown_of(const RecordState& record, std::size_t column) const {
  if (column < m) return record.unknown[column];
  return column < m + free.size() ? static_cast<int>(column - m)
                                  : static_cast<int>(unknowns.size());
}

// Linearises (5.8) with condensed states of the segments; the share `closing` of the gap between the
// end of a segment and the start of the next one is closed. From products of the rows, where these
// tell R; else from the rows themselves, whose condition is not squared.
void TransientEstimator::Impl::linearise(double closing) {
  const auto q = static_cast<Eigen::Index>(unknowns.size());
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(q + 1, q + 1);
  sum_of_squares = gaps = 0.0;
  fit.largest_gap = 0.0;
  for (std::size_t index = 0; index < records.size(); ++index) {
    const RecordState& record = records[index];
    std::vector<ArcEnd> ends;
    for (std::size_t a = 0; a < record.arcs; ++a)
      ends.push_back({sums.end(record.first_arc + a), sums.derivatives(record.first_arc + a)});
    shooting[index].condense(std::span(arcs).subspan(record.first_arc, record.arcs), ends, closing);
    add_gaps(index);
    add_record_products(index, products);
  }
  const Eigen::MatrixXd prior = prior_rows();
  products += prior.transpose() * prior;
  closed_squares = products(q, q);
  if (!factor(products)) linearise_by_rows();
}

void TransientEstimator::Impl::add_gaps(std::size_t index) {
  const RecordState& record = records[index];
  const auto seen = static_cast<std::size_t>(model.observed());
  const std::size_t k = m + free.size();
  for (std::size_t a = 0; a < record.arcs; ++a) {
    const std::size_t arc = record.first_arc + a;
    sum_of_squares += record.data.weight * sums.products(arc)[(k + 1) * (k + 1) - 1];
    for (std::size_t j = 0; a + 1 < record.arcs && j < m; ++j) {
      const double relative = shooting[index].gaps()[a * m + j] / record.scale[j];
      fit.largest_gap = std::max(fit.largest_gap, std::fabs(relative));
      gaps += kGapWeight * record.data.weight * static_cast<double>(arcs[arc].measured.size()) *
              std::pow(relative * record.scale[seen], 2);
    }
  }
}

void TransientEstimator::Impl::add_record_products(std::size_t index,
                                                   Eigen::MatrixXd& products) const {
  const RecordState& record = records[index];
  const std::size_t wide = m + free.size() + 1;
  std::vector<double> own(wide * wide, 0.0);
  shooting[index].add_products(sums, record.first_arc, own);
  for (std::size_t i = 0; i < wide; ++i) {
    for (std::size_t k = 0; k < wide; ++k) {
      const int row = unknown_of(record, i), column = unknown_of(record, k);
      if (row >= 0 && column >= 0) products(row, column) += record.data.weight * own[i * wide + k];
    }
  }
}

// R and Q^T r from the products of all rows; false where rounding hides a direction.
bool TransientEstimator::Impl::factor(const Eigen::MatrixXd& products) {
  const auto q = static_cast<Eigen::Index>(unknowns.size());
  const Eigen::VectorXd scale = products.diagonal().head(q).cwiseSqrt();
  if (q == 0 || !(scale.minCoeff() > 0.0) || !products.allFinite()) return false;
  const Eigen::VectorXd over = scale.cwiseInverse();
  const Cholesky root(over.asDiagonal() * products.topLeftCorner(q, q) * over.asDiagonal());
  if (!root.positive()) return false;
  const Eigen::MatrixXd lower = root.root();
  if (!(lower.diagonal().minCoeff() > std::sqrt(kPositive))) return false;
  r = lower.transpose() * scale.asDiagonal();
  right = root.whiten(Eigen::VectorXd(over.cwiseProduct(products.col(q).head(q))));
  return true;
}

void TransientEstimator::Impl::linearise_by_rows() {
  keep();
  information.clear();
  const auto q = static_cast<Eigen::Index>(unknowns.size());
  const std::size_t columns = m + free.size();
  const auto seen = static_cast<std::size_t>(model.observed());
  for (std::size_t a = 0; a < arcs.size(); ++a) {
    const RecordState& record = records[record_of[a]];
    const double root = std::sqrt(record.data.weight);
    for (std::size_t i = 0; i < arcs[a].measured.size(); ++i) {
      const std::size_t node = arcs[a].first_measured + i;
      const Eigen::RowVectorXd over = shooting[record_of[a]].row(
          a - record.first_arc, &arcs[a].sensitivities[(node * m + seen) * columns]);
      auto row = information.row();
      for (std::size_t c = 0; c < columns; ++c) {
        const int unknown = unknown_of(record, c);
        if (unknown >= 0) row[unknown] = root * over[static_cast<Eigen::Index>(c)];
      }
      row[q] = root * (arcs[a].measured[i] - arcs[a].states[node * m + seen] +
                       over[static_cast<Eigen::Index>(columns)]);
    }
  }
  const Eigen::MatrixXd prior = prior_rows();
  for (Eigen::Index i = 0; i < prior.rows(); ++i)
    information.row() = prior.row(i);
  information.finish();
  r = information.r();
  right = information.right();
}

}  // namespace shaker::estimator
