#include "estimator/diagnosis/report/internal/effect_sizes.hpp"

#include <cmath>
#include <optional>

#include "estimator/math/dense.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The value of a parameter without its effect; nothing for one that only shapes the effect.
std::optional<double> absent_value(const ModelParameter& p) {
  const Effect* effect = find_effect(p.effect);
  if (effect == nullptr) return std::nullopt;
  for (const ParameterInfo& info : effect->parameters()) {
    if (info.symbol == p.symbol && !std::isnan(info.absent)) return info.absent;
  }
  return std::nullopt;
}

// Theta less its values without the effect; 0 for all other parameters.
VectorXd way_to_effect(const HarmonicFit& fit, std::size_t base, const std::string& effect) {
  const auto& parameters = fit.model->parameters();
  VectorXd way = VectorXd::Zero(static_cast<Index>(parameters.size()));
  Index first = -1;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const ModelParameter& p = parameters[k];
    if (p.line < base || p.effect != effect) continue;
    const auto at = static_cast<Index>(k);
    if (first < 0) first = at;
    if (const auto absent = absent_value(p)) way[at] = fit.theta[k] - *absent;
  }
  if (first >= 0 && way.isZero(0.0)) way[first] = fit.theta[static_cast<std::size_t>(first)];
  return way;
}

}  // namespace

double size_of(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t base,
               const std::string& effect) {
  const VectorXd way = way_to_effect(fit, base, effect);
  std::vector<Index> mimics;
  for (const int k : fit.free) {
    if (fit.model->parameters()[static_cast<std::size_t>(k)].line < base) mimics.push_back(k);
  }
  std::vector<std::size_t> runs;
  Index rows = 0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit || data[r].quantity != Quantity::displacement) continue;
    runs.push_back(r);
    rows += data[r].response.size();
  }
  MatrixXd all(rows, static_cast<Index>(mimics.size()) + 1);
  Index row = 0;
  for (const std::size_t r : runs) {
    const MatrixXd& slope = fit.predictions[r].jacobian();
    const auto count = slope.rows();
    const auto put = [&](Index column, const VectorXd& change) {
      all.col(column).segment(row, count) = without_own_zero(data[r], change);
    };
    for (std::size_t k = 0; k < mimics.size(); ++k)
      put(static_cast<Index>(k), slope.col(mimics[k]));
    put(all.cols() - 1, slope * way);
    row += count;
  }
  if (!all.allFinite()) return 0.0;
  const MatrixXd known = all.leftCols(all.cols() - 1);
  const VectorXd change = all.rightCols(1);
  const VectorXd left = change - known * shortest_least_squares(known, change);
  double sum = 0.0;
  row = 0;
  for (const std::size_t r : runs) {
    const auto count = data[r].response.size();
    sum += std::pow(root_mean_square(left.segment(row, count)), 2);
    row += count;
  }
  return std::sqrt(sum / static_cast<double>(runs.size()));
}

}  // namespace shaker::estimator::diagnosis
