#include "estimator/diagnosis/noise/internal/noise.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostFreedom = 400.0;  // no prior is surer than that
constexpr double kLeastFreedom = 0.5;
constexpr Index kGroupsACovariate = 5;

double inverse_trigamma(double y) {
  if (y > 1e7) return 1.0 / std::sqrt(y);
  if (y < 1e-6) return 1.0 / y;
  double x = 0.5 + 1.0 / y;
  for (int i = 0; i < 50; ++i) {
    const double t = trigamma(x);
    const double step = t * (1.0 - t / y) / tetragamma(x);
    x += step;
    if (-step / x < 1e-8) break;
  }
  return x;
}

// Mean power of the slowest course over the cycles, over the mean power of all of them: 1 when
// cycles are independent. `freedom` gets the real degrees of freedom behind the numerator.
struct SlowShare {
  double slow = 0.0, all = 0.0;  // sums of squares
  double slow_count = 0.0, all_count = 0.0;
};

void add_slow_share(const MatrixXd& scaled, Index first, Index last, SlowShare& share) {
  const Index n = scaled.rows();
  const VectorXd mean = scaled.colwise().mean();
  for (Index c = first; c < last; ++c) {
    const VectorXd course = scaled.col(c).array() - mean[c];
    const auto slowest = fourier_sum({course.data(), static_cast<std::size_t>(n)}, 1);
    share.slow += 2.0 * std::norm(slowest) / static_cast<double>(n);
    share.slow_count += 2.0;
    share.all += course.squaredNorm();
    share.all_count += static_cast<double>(n - 1);
  }
}

double freedom_of(const Scatter& run, Index component) {
  const double taken = run.spent.size() > 0 ? run.spent[component] : 0.0;
  return std::max(kLeastFreedom, static_cast<double>(run.cycles.rows()) - 1.0 - taken);
}

double variance_inflation(const SlowShare& share) {
  if (share.slow_count < 4.0) return 1.0;
  const double ratio = (share.slow / share.slow_count) / (share.all / share.all_count);
  const double chance = 1.0 + 3.0 * std::sqrt(2.0 / share.slow_count);
  return ratio > chance ? ratio : 1.0;
}

// Each run has a level of its own, all share the colour: what shook one run more does not speak
// for the others.
Index covariates(Index groups, Index runs) {
  if (groups >= kGroupsACovariate * (runs + 2)) return runs + 2;
  return groups >= 12 ? 4 : 1;
}

void put_trend(MatrixXd& trend, Index group, Index run, double run_hz, double hz, Index runs) {
  const double colour = std::log(hz);
  if (trend.cols() == runs + 2) {
    trend(group, run) = 1.0;
    trend(group, runs) = colour;
    trend(group, runs + 1) = colour * colour;
    return;
  }
  trend(group, 0) = 1.0;
  if (trend.cols() < 4) return;
  trend(group, 1) = colour;
  trend(group, 2) = colour * colour;
  trend(group, 3) = std::log(run_hz);
}

}  // namespace

void moderate(const MatrixXd& trend, VectorXd& variance, VectorXd& freedom) {
  const Index n = variance.size();
  if (n < trend.cols() + 2) return;
  VectorXd e(n), error(n);
  for (Index g = 0; g < n; ++g) {
    const double half = 0.5 * freedom[g];
    e[g] = std::log(variance[g]) - digamma(half) + std::log(half);
    error[g] = trigamma(half);
  }
  const VectorXd root = error.cwiseInverse().cwiseSqrt();
  const PivotedQr qr(root.asDiagonal() * trend);
  const VectorXd fitted = trend * qr.solve(VectorXd(root.cwiseProduct(e)));
  const double excess =
      (e - fitted).squaredNorm() / static_cast<double>(n - qr.rank()) - error.mean();
  const double prior =
      excess > 0.0 ? std::min(kMostFreedom, 2.0 * inverse_trigamma(excess)) : kMostFreedom;
  // The centre is itself an estimate, from neighbours that lend no more than they have.
  const MatrixXd basis = qr.basis(qr.rank());
  const double spread = trigamma(0.5 * prior);
  const double bias = digamma(0.5 * prior) - std::log(0.5 * prior);
  for (Index g = 0; g < n; ++g) {
    const double unsure = basis.row(g).squaredNorm() * (error[g] + spread);
    const double lent = 2.0 * inverse_trigamma(spread + unsure);
    const double centre = std::exp(fitted[g] + bias);
    variance[g] = (lent * centre + freedom[g] * variance[g]) / (lent + freedom[g]);
    freedom[g] += lent;
  }
}

CampaignNoise campaign_noise(const std::vector<Scatter>& runs) {
  CampaignNoise noise;
  Index groups = 0;
  for (const Scatter& run : runs)
    groups += (run.cycles.cols() - 1) / 2;
  const auto count = static_cast<Index>(runs.size());
  VectorXd variance(groups), freedom(groups), mean_variance(count), mean_freedom(count);
  MatrixXd trend = MatrixXd::Zero(groups, covariates(groups, count));
  Index g = 0;
  double largest = 0.0;
  for (const Scatter& run : runs)
    largest = std::max(largest, run.cycles.cwiseAbs().maxCoeff());
  const double least = 1e-26 * largest * largest + 1e-60;  // noise-free data: what rounding leaves
  SlowShare of_means, of_harmonics;
  for (Index r = 0; r < count; ++r) {
    const Scatter& run = runs[static_cast<std::size_t>(r)];
    const MatrixXd centred = run.cycles.rowwise() - run.cycles.colwise().mean();
    const VectorXd squares = centred.colwise().squaredNorm();
    mean_freedom[r] = freedom_of(run, 0);
    mean_variance[r] = std::max(squares[0] / mean_freedom[r], least);
    VectorXd scale(run.cycles.cols());
    scale[0] = std::sqrt(mean_variance[r]);
    for (Index c = 1; c + 1 < run.cycles.cols(); c += 2, ++g) {
      freedom[g] = freedom_of(run, c) + freedom_of(run, c + 1);
      variance[g] = std::max((squares[c] + squares[c + 1]) / freedom[g], least);
      scale[c] = scale[c + 1] = std::sqrt(variance[g]);
      put_trend(trend, g, r, run.frequency_hz, run.frequency_hz * harmonic_order(c), count);
    }
    const MatrixXd scaled = centred * scale.cwiseInverse().asDiagonal();
    add_slow_share(scaled, 0, 1, of_means);
    add_slow_share(scaled, 1, run.cycles.cols(), of_harmonics);
  }
  moderate(trend, variance, freedom);
  moderate(MatrixXd::Ones(count, 1), mean_variance, mean_freedom);
  const double mean_carry = variance_inflation(of_means);
  const double carry = variance_inflation(of_harmonics);
  noise.variance_inflation = std::max(mean_carry, carry);
  g = 0;
  for (Index r = 0; r < count; ++r) {
    const Scatter& run = runs[static_cast<std::size_t>(r)];
    const auto n = static_cast<double>(run.cycles.rows());
    RunNoise one{VectorXd(run.cycles.cols()), VectorXd(run.cycles.cols())};
    one.variance[0] = mean_carry * mean_variance[r] / n;
    one.freedom[0] = mean_freedom[r];
    for (Index c = 1; c + 1 < run.cycles.cols(); c += 2, ++g) {
      one.variance[c] = one.variance[c + 1] = carry * variance[g] / n;
      one.freedom[c] = one.freedom[c + 1] = freedom[g];
    }
    noise.runs.push_back(std::move(one));
  }
  return noise;
}

}  // namespace shaker::estimator::diagnosis
