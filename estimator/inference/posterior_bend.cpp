#include "estimator/inference/internal/posterior_bend.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/inference/internal/posterior_proposal.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMinEffectiveDraws =
    4.0;  // effective draws for each coefficient; with fewer the mean stays zero
constexpr double kMinVariance = 1e-14;

// The monomials 1, y_i and y_i y_j of the first `count` elements of y.
VectorXd powers(const VectorXd& y, Index count) {
  VectorXd out(1 + count + count * (count + 1) / 2);
  out[0] = 1.0;
  out.segment(1, count) = y.head(count);
  Index next = 1 + count;
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j <= i; ++j)
      out[next++] = y[i] * y[j];
  }
  return out;
}

}  // namespace

Bend::Bend(const Draws& draws) : mean_(draws.mean), scatter_(draws.mean.size()) {
  // The spectrum of the correlations is independent of units; it ascends, so the softest is last.
  const VectorXd deviation = draws.covariance.diagonal().cwiseSqrt();
  const MatrixXd unit = deviation.cwiseInverse().asDiagonal();
  const Spectrum spectrum = spectrum_of(unit * draws.covariance * unit);
  const VectorXd length = spectrum.values.reverse().cwiseMax(kMinVariance).cwiseSqrt();
  const MatrixXd vectors = spectrum.vectors.rowwise().reverse();
  directions_ = deviation.asDiagonal() * vectors * length.asDiagonal();
  inverse_ = length.cwiseInverse().asDiagonal() * vectors.transpose() * unit;
  volume_ = deviation.prod() * length.prod();
  std::vector<VectorXd> y;
  for (const VectorXd& theta : draws.theta)
    y.push_back(inverse_ * (theta - mean_));
  for (Index k = 0; k < mean_.size(); ++k)
    follow(k, y, draws);
}

// Weighted least squares of direction k on those before it.
void Bend::follow(Index k, const std::vector<VectorXd>& y, const Draws& draws) {
  const Index terms = powers(y.front(), k).size();
  const double freedom = 1.0 - static_cast<double>(terms) / draws.effective;
  scatter_[k] = 1.0;
  coefficients_.emplace_back(VectorXd::Zero(terms));
  if (draws.effective < kMinEffectiveDraws * static_cast<double>(terms)) return;
  MatrixXd products = MatrixXd::Zero(terms, terms);
  VectorXd right = VectorXd::Zero(terms);
  double square = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double weight = draws.weight[i];
    if (!(weight > 0.0)) continue;
    const VectorXd p = powers(y[i], k);
    add_square(products, p, weight);
    right += weight * y[i][k] * p;
    square += weight * y[i][k] * y[i][k];
  }
  const VectorXd best = Ldlt(products).solve(right);
  const double left = (square - best.dot(right)) / freedom;
  if (!best.allFinite() || !(left > kMinVariance)) return;
  coefficients_.back() = best;
  scatter_[k] = std::sqrt(left);
}

VectorXd Bend::draw(std::mt19937_64& random) const {
  const VectorXd z = heavy_tailed(mean_.size(), random);
  VectorXd y(z.size());
  for (Index k = 0; k < z.size(); ++k)
    y[k] = coefficients_[static_cast<std::size_t>(k)].dot(powers(y, k)) + scatter_[k] * z[k];
  return mean_ + directions_ * y;
}

double Bend::density(const VectorXd& at) const {
  const VectorXd y = inverse_ * (at - mean_);
  VectorXd z(y.size());
  for (Index k = 0; k < z.size(); ++k)
    z[k] = y[k] - coefficients_[static_cast<std::size_t>(k)].dot(powers(y, k));
  return heavy_tailed_density(z, VectorXd::Zero(z.size()), scatter_.asDiagonal()) / volume_;
}

}  // namespace shaker::estimator
