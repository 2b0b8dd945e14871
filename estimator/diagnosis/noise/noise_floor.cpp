#include "estimator/diagnosis/noise/internal/noise_floor.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kDraws = 2000, kRecordDraws = 400;  // a record has many times as many data
constexpr double kBelow = 0.95;                   // of the draws

bool fitted(const RunDatum& datum) {
  return datum.role == Role::fit;
}

// Noise of all runs in units of its estimated standard errors, a column a draw.
MatrixXd drawn(const std::vector<RunDatum>& data, Index draws) {
  Index rows = 0;
  for (const RunDatum& datum : data)
    rows += datum.response.size();
  MatrixXd noise(rows, draws);
  std::mt19937_64 source(1);
  std::normal_distribution<double> normal;
  for (Index d = 0; d < draws; ++d) {
    Index at = 0;
    for (const RunDatum& datum : data) {
      double scale = 1.0;
      for (Index i = 0; i < datum.response.size(); ++i) {
        // Cosine and sine share one estimated variance: chi-squared over its freedom, after Wilson
        // and Hilferty.
        if (i == 0 || i % 2 == 1 || datum.freedom[i] != datum.freedom[i - 1]) {
          const double c = 2.0 / (9.0 * datum.freedom[i]);
          const double root = std::max(1.0 - c + std::sqrt(c) * normal(source), 0.1);
          scale = 1.0 / std::sqrt(root * root * root);
        }
        noise(at++, d) = scale * normal(source);
      }
    }
  }
  return noise;
}

// Columns of what is fitted to a run: parameters that are not at a bound, and the time base.
MatrixXd columns_of(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t run) {
  std::vector<int> inside;
  for (const int k : fit.free) {
    if (!fit.at_bound(k)) inside.push_back(k);
  }
  MatrixXd columns(data[run].response.size(), static_cast<Index>(inside.size()) + 1);
  columns.leftCols(columns.cols() - 1) = whitened_jacobian(fit, data, run, inside);
  columns.col(columns.cols() - 1).setZero();
  if (data[run].clock.size() > 0)
    columns.col(columns.cols() - 1) = whitened(data[run], data[run].clock);
  return columns;
}

double level(std::vector<double>& draws) {
  const auto at =
      draws.begin() + static_cast<std::ptrdiff_t>(kBelow * static_cast<double>(draws.size()));
  std::nth_element(draws.begin(), at, draws.end());
  return *at;
}

}  // namespace

NoiseFloor noise_floor(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                       std::size_t shown) {
  const bool record = on_samples(data);
  const Index draws = record ? kRecordDraws : kDraws;
  const MatrixXd noise = drawn(data, draws);
  std::vector<MatrixXd> columns;
  MatrixXd gram;
  MatrixXd moved;
  Index at = 0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    columns.push_back(columns_of(fit, data, r));
    const Index size = data[r].response.size();
    if (r == 0) {
      gram = MatrixXd::Zero(columns[0].cols(), columns[0].cols());
      gram(gram.rows() - 1, gram.cols() - 1) = 1.0;  // what is known of the time base
      moved = MatrixXd::Zero(columns[0].cols(), draws);
    }
    if (fitted(data[r])) {
      gram += columns[r].transpose() * columns[r];
      moved += columns[r].transpose() * noise.middleRows(at, size);
    }
    at += size;
  }
  const VectorXd scale = gram.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd unit = scale.asDiagonal() * gram * scale.asDiagonal();
  const MatrixXd step =
      scale.asDiagonal() * shortest_least_squares(unit, scale.asDiagonal() * moved);
  std::vector<double> all(static_cast<std::size_t>(draws), 0.0), own(all.size());
  double squares = 0.0, runs = 0.0;
  NoiseFloor found;
  at = 0;
  for (std::size_t r = 0; r < shown; ++r) {
    const MatrixXd left =
        coloured(data[r], noise.middleRows(at, data[r].response.size()) - columns[r] * step);
    at += data[r].response.size();
    for (Index d = 0; d < draws; ++d) {
      const auto i = static_cast<std::size_t>(d);
      own[i] = root_mean_square(without_own_zero(data[r], left.col(d)));
      if (fitted(data[r])) all[i] += own[i] * own[i];
    }
    found.runs.push_back({root_mean_square(without_own_zero(data[r], data[r].error)), level(own)});
    if (!fitted(data[r])) continue;
    squares += found.runs[r].expected * found.runs[r].expected;
    runs += 1.0;
  }
  found.whole = {std::sqrt(squares / runs), std::sqrt(level(all) / runs)};
  return found;
}

}  // namespace shaker::estimator::diagnosis
