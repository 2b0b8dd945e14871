#include "estimator/signal/harmonic_curve.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"
#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;

constexpr Index kRowsInBlock = 256;      // of the normal equations
constexpr int kExcitationHarmonics = 8;  // of a measured excitation
constexpr std::size_t kExcitationPoints = 64;
constexpr int kMaxHarmonicsOfGroup = 24;    // above them an oleo's velocity reversals show
constexpr double kHarmonicsTimesGap = 0.4;  // largest gap between phases; the limit is 0.5

// Rows of the basis for the samples from `first` on. The transpose: a row of the basis is a column.
Eigen::MatrixXd basis_columns(const std::vector<double>& tau, Index size, Index first,
                              Index count) {
  Eigen::MatrixXd columns(size, count);
  for (Index i = 0; i < count; ++i)
    fill_harmonic_row(tau[static_cast<std::size_t>(first + i)],
                      {columns.col(i).data(), static_cast<std::size_t>(size)});
  return columns;
}

// The number of harmonics of the period that samples at these phases determine.
int determined_harmonics(std::vector<double> tau) {
  std::sort(tau.begin(), tau.end());
  double gap = tau.front() + 1.0 - tau.back();
  for (std::size_t i = 1; i < tau.size(); ++i)
    gap = std::max(gap, tau[i] - tau[i - 1]);
  return static_cast<int>(kHarmonicsTimesGap / gap);
}

}  // namespace

std::vector<double> HarmonicCurve::on_grid(std::size_t points) const {
  std::vector<double> out, row(coefficients.size());
  const auto size = static_cast<Index>(row.size());
  const Eigen::Map<const Eigen::VectorXd> terms(row.data(), size), c(coefficients.data(), size);
  for (std::size_t i = 0; i < points; ++i) {
    fill_harmonic_row(static_cast<double>(i) / static_cast<double>(points), row);
    out.push_back(terms.dot(c));
  }
  return out;
}

HarmonicCurve fit_harmonics(const std::vector<double>& tau, const std::vector<double>& y,
                            int harmonics) {
  const Index size = 1 + 2 * harmonics, count = static_cast<Index>(y.size());
  const Eigen::Map<const Eigen::VectorXd> all(y.data(), count);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  const auto for_each_block = [&](const auto& visit) {
    for (Index first = 0; first < count; first += kRowsInBlock) {
      const Index rows = std::min(kRowsInBlock, count - first);
      visit(basis_columns(tau, size, first, rows), all.segment(first, rows));
    }
  };
  for_each_block([&](const Eigen::MatrixXd& basis, const auto& values) {
    add_gram(normal, basis.transpose());
    right += basis * values;
  });
  const Eigen::VectorXd c = shortest_least_squares(symmetric_of_lower(normal), right);
  HarmonicCurve curve{{c.begin(), c.end()}, 0.0};
  for_each_block([&](const Eigen::MatrixXd& basis, const auto& values) {
    curve.residual += (values - basis.transpose() * c).squaredNorm();
  });
  return curve;
}

CycleExcitation fit_excitation(const std::vector<double>& tau, const std::vector<double>& x) {
  const auto count = static_cast<double>(tau.size());
  const int harmonics = std::min(kExcitationHarmonics, static_cast<int>((tau.size() - 1) / 4));
  HarmonicCurve curve = fit_harmonics(tau, x, harmonics);
  const double left_over = std::max(1.0, count - static_cast<double>(curve.coefficients.size()));
  CycleExcitation out;
  out.error = std::sqrt(2.0 * curve.residual / count / left_over);
  curve.coefficients[0] = 0.0;
  out.samples = curve.on_grid(kExcitationPoints);
  return out;
}

GroupMean mean_of_groups(const std::vector<double>& t, const std::vector<double>& y,
                         double frequency_hz, const Cycles& cycles, int periods) {
  if (points_of_equal_steps(t, frequency_hz) > 0)
    return {mean_cycle(cycles.y, cycles.points * static_cast<std::size_t>(periods)),
            static_cast<double>(cycles.points / 2)};
  const double first = std::ceil(t.front() * frequency_hz - 1e-9);
  const double groups = std::floor(static_cast<double>(cycles.count()) / periods);
  std::vector<double> tau, value;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double turn = (t[i] * frequency_hz - first) / periods;
    if (turn < 0.0 || turn >= groups) continue;
    tau.push_back(turn - std::floor(turn));
    value.push_back(y[i]);
  }
  const int harmonics = std::min(kMaxHarmonicsOfGroup * periods, determined_harmonics(tau));
  GroupMean out;
  out.harmonics = static_cast<double>(harmonics) / periods;
  if (harmonics < kMinHarmonicsOfGroup * periods) return out;
  const HarmonicCurve curve = fit_harmonics(tau, value, harmonics);
  const std::size_t points = curve.coefficients.size();
  out.group = {curve.on_grid(points), curve.residual,
               static_cast<double>(value.size()) / static_cast<double>(points)};
  return out;
}

}  // namespace shaker::estimator
