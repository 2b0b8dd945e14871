#include "estimator/diagnosis/cycles/internal/cycle_line.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostAlike = 0.9;
constexpr double kByChance = 2.0;  // standard errors of a correlation

// Sums for the correlation of neighbours in what a line leaves.
struct Alike {
  double next = 0.0, own = 0.0, pairs = 0.0, lost = 0.0;
  // Factor on the variance of a slope. A line takes 2 of n degrees of freedom, and what is left
  // looks less alike by 2 / n about; what chance makes does not count.
  double factor() const {
    if (!(own > 0.0) || pairs < 4.0) return 1.0;
    const double shift = lost / pairs;
    const double rho = (next / own + shift) / (1.0 - shift);
    if (rho < kByChance / std::sqrt(pairs)) return 1.0;
    const double least = std::min(rho, kMostAlike);
    return (1.0 + least) / (1.0 - least);
  }
};

void add(const MatrixXd& left, const VectorXd& scale, Index first, Index last, Alike& sum) {
  const Index n = left.rows();
  for (Index c = first; c < last; ++c) {
    if (!(scale[c] > 0.0)) continue;
    const VectorXd unit = left.col(c) / scale[c];
    sum.next += unit.head(n - 1).dot(unit.tail(n - 1));
    sum.own += unit.squaredNorm();
    sum.pairs += static_cast<double>(n - 1);
    sum.lost += 2.0;
  }
}

}  // namespace

std::vector<CycleLine> lines_through(const std::vector<MatrixXd>& cycles,
                                     const std::vector<VectorXd>& when) {
  std::vector<CycleLine> lines;
  Alike means, harmonics;
  for (std::size_t r = 0; r < cycles.size(); ++r) {
    const VectorXd t = when[r].array() - when[r].mean();
    const double span = t.squaredNorm();
    CycleLine line;
    line.freedom = static_cast<double>(cycles[r].rows()) - 2.0;
    line.rate = cycles[r].transpose() * t / span;
    const MatrixXd left =
        cycles[r].rowwise() - cycles[r].colwise().mean() - t * line.rate.transpose();
    VectorXd variance = left.colwise().squaredNorm().transpose() / line.freedom;
    for (Index c = 1; c + 1 < variance.size(); c += 2)
      variance[c] = variance[c + 1] = 0.5 * (variance[c] + variance[c + 1]);
    const VectorXd scale = variance.cwiseSqrt();
    add(left, scale, 0, 1, means);
    add(left, scale, 1, scale.size(), harmonics);
    line.error = scale / std::sqrt(span);
    lines.push_back(std::move(line));
  }
  for (CycleLine& line : lines) {
    line.error[0] *= std::sqrt(means.factor());
    line.error.tail(line.error.size() - 1) *= std::sqrt(harmonics.factor());
  }
  return lines;
}

}  // namespace shaker::estimator::diagnosis
