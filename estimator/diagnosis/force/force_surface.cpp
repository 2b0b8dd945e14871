#include "estimator/diagnosis/force/force_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/math/dense.hpp"
#include "estimator/math/simd_math.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kAcross = 20, kAlong = 12;  // splines over the stroke and over the velocity
constexpr double kFineSpeed = 0.15;  // of the largest: below it the axis is even, above logarithmic
constexpr double kJump = 0.01;  // of it: over which a force may jump where the motion turns round
constexpr double kSmooth[] = {0.12, 0.3, 0.8, 2.5};  // lengths of the prior, axes from 0 to 1
constexpr int kHalvings = 50;                        // of an interval about an eigenvalue
constexpr int kRatios = 8;                           // of noise to prior, that are weighed together
constexpr int kFactors = 8;  // of a product whose logarithm is taken: 1e-16 to 1 each

// Uniform cubic B-splines on 0..1, the four about `at`.
void cubic(double at, Index count, Index& first, double weights[4]) {
  const double place = std::clamp(at, 0.0, 1.0) * static_cast<double>(count - 3);
  first = std::min(static_cast<Index>(place), count - 4);
  const double t = place - static_cast<double>(first), s = 1.0 - t;
  weights[0] = s * s * s / 6.0;
  weights[1] = (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0;
  weights[2] = (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0;
  weights[3] = t * t * t / 6.0;
}

// The residual's variance by a prior, made tridiagonal, with the residual in the same directions.
// `rest`: the residual's square in directions that no surface reaches.
struct Trial {
  Tridiagonal prior;
  double rest = 0.0, rest_count = 0.0;
};

// The largest eigenvalue, by bisection: x is larger where all pivots of prior - x are negative.
double largest_of(const Tridiagonal& prior) {
  const Index n = prior.diagonal.size();
  double low = prior.diagonal.maxCoeff();
  double high = low + 2.0 * (n > 1 ? prior.beside.cwiseAbs().maxCoeff() : 0.0);
  for (int halved = 0; halved < kHalvings; ++halved) {
    const double x = 0.5 * (low + high);
    double pivot = prior.diagonal[0] - x;
    for (Index k = 1; k < n && pivot < 0.0; ++k)
      pivot = prior.diagonal[k] - x - prior.beside[k - 1] * prior.beside[k - 1] / pivot;
    (pivot < 0.0 ? high : low) = x;
  }
  return high;
}

// Logarithm of the determinant of prior + ratio, and the residual's square weighted by its inverse,
// for some ratios at once: each pivot waits for a division by the one before.
struct RatioSums {
  double log_size[kRatios], square[kRatios];
};

SHAKER_SIMD_CLONES RatioSums sums_at(const Tridiagonal& prior, const double* ratios) {
  const Index n = prior.diagonal.size();
  double pivot[kRatios], along[kRatios], product[kRatios];
  RatioSums sum{};
  for (int r = 0; r < kRatios; ++r) {
    pivot[r] = product[r] = 1.0;
    along[r] = 0.0;
  }
  double beside = 0.0;
  for (Index k = 0; k < n; ++k) {
    for (int r = 0; r < kRatios; ++r) {
      const double factor = beside / pivot[r];
      // Rounding may take it below what the noise alone makes of it.
      pivot[r] = std::max(prior.diagonal[k] + ratios[r] - factor * beside, ratios[r]);
      along[r] = prior.rotated[k] - factor * along[r];
      sum.square[r] += along[r] * along[r] / pivot[r];
      product[r] *= pivot[r];
    }
    if (k + 1 < n) beside = prior.beside[k];
    if (k % kFactors != kFactors - 1 && k + 1 < n) continue;
    for (int r = 0; r < kRatios; ++r) {
      sum.log_size[r] += std::log(product[r]);
      product[r] = 1.0;
    }
  }
  return sum;
}

// The likeliest size of a prior, and noise.
struct Likeliest {
  double evidence = -std::numeric_limits<double>::infinity(), size = 1.0, noise = 1.0;
};

Likeliest likeliest(Trial trial, double least_noise) {
  // In units of the prior's largest variance.
  const double scale = 1.0 / std::max(largest_of(trial.prior), 1e-300);
  trial.prior.diagonal *= scale;
  trial.prior.beside *= scale;
  const auto count = static_cast<double>(trial.prior.diagonal.size());
  std::vector<double> sizes;
  for (double size = 0.1; size < 1e10; size *= 3.0)
    sizes.push_back(size);
  Likeliest best;
  for (double noise = least_noise; noise < 1e5; noise *= 1.5) {
    for (std::size_t from = 0; from < sizes.size(); from += kRatios) {
      double ratios[kRatios];
      for (std::size_t r = 0; r < kRatios; ++r)
        ratios[r] = noise / sizes[std::min(from + r, sizes.size() - 1)];
      const RatioSums sum = sums_at(trial.prior, ratios);
      for (std::size_t r = 0; r < kRatios && from + r < sizes.size(); ++r) {
        const double size = sizes[from + r];
        const double evidence =
            -0.5 * (count * std::log(size) + sum.log_size[r] + sum.square[r] / size +
                    trial.rest_count * std::log(noise) + trial.rest / noise);
        if (evidence > best.evidence) best = {evidence, size * scale, noise};
      }
    }
  }
  return best;
}

}  // namespace

ForceSurface::ForceSurface(double low, double high, double speed)
    : low_(low), high_(high), speed_(speed) {}

Index ForceSurface::size() const {
  return kAcross * (kAlong + 1);
}

MatrixXd ForceSurface::splines(const VectorXd& stroke, const VectorXd& velocity) const {
  MatrixXd values = MatrixXd::Zero(stroke.size(), size());
  const double most = std::asinh(1.0 / kFineSpeed);
  for (Index i = 0; i < stroke.size(); ++i) {
    Index row = 0, column = 0;
    double across[4], along[4];
    cubic((stroke[i] - low_) / (high_ - low_), kAcross, column, across);
    cubic(0.5 + 0.5 * std::asinh(velocity[i] / (kFineSpeed * speed_)) / most, kAlong, row, along);
    for (Index a = 0; a < 4; ++a) {
      for (Index b = 0; b < 4; ++b)
        values(i, (row + a) * kAcross + column + b) = along[a] * across[b];
    }
    const double way = std::tanh(velocity[i] / (kJump * speed_));
    for (Index b = 0; b < 4; ++b)
      values(i, kAlong * kAcross + column + b) = way * across[b];
  }
  return values;
}

// Matern's of order 3/2: smooth, but for corners that the data insist on.
MatrixXd ForceSurface::covariance(double along_stroke, double along_velocity) const {
  double of[kAlong][kAcross];  // that many splines apart
  for (Index row = 0; row < kAlong; ++row) {
    for (Index column = 0; column < kAcross; ++column) {
      const double u = static_cast<double>(column) / (kAcross - 3) / along_stroke;
      const double v = static_cast<double>(row) / (kAlong - 3) / along_velocity;
      const double d = std::sqrt(3.0) * std::hypot(u, v);
      of[row][column] = (1.0 + d) * std::exp(-d);
    }
  }
  MatrixXd k(size(), size());
  for (Index j = 0; j < size(); ++j) {
    for (Index i = 0; i < size(); ++i) {
      // What jumps at velocity reversal is independent of the rest.
      const Index mine = i / kAcross, theirs = j / kAcross;
      const bool apart = (mine == kAlong) != (theirs == kAlong);
      k(i, j) = apart ? 0.0 : of[std::abs(mine - theirs)][std::abs(i % kAcross - j % kAcross)];
    }
  }
  k.diagonal().array() += 1e-9;
  return k;
}

SeenPriors ForceSurface::seen_by(const MatrixXd& reach) const {
  constexpr Index kEven = kAcross * kAlong;  // independent of what jumps
  const MatrixXd even = reach.leftCols(kEven), jump = reach.rightCols(kAcross);
  SeenPriors of{reach, {}};
  for (const double along_stroke : kSmooth) {
    for (const double along_velocity : kSmooth) {
      const MatrixXd prior = covariance(along_stroke, along_velocity);
      of.seen.push_back(even * prior.topLeftCorner(kEven, kEven) * even.transpose() +
                        jump * prior.bottomRightCorner(kAcross, kAcross) * jump.transpose());
    }
  }
  return of;
}

SurfaceFit ForceSurface::fit(const SurfaceData& data, double least_noise,
                             std::vector<SeenPriors>& known) const {
  // Orthogonal to all that the nuisances can do.
  MatrixXd nuisance = data.nuisance;
  for (Index k = 0; k < nuisance.cols(); ++k) {
    const double norm = nuisance.col(k).norm();
    if (norm > 0.0) nuisance.col(k) /= norm;
  }
  PivotedQr qr(nuisance);
  qr.set_threshold(1e-9);
  const Index left = nuisance.rows() - qr.rank();
  const VectorXd residual = qr.rotated(data.residual).bottomRows(left);
  MatrixXd reach = qr.rotated(data.reach).bottomRows(left);
  VectorXd seen = residual;
  double unreached = 0.0, unreached_count = 0.0;
  if (left > size()) {  // only the directions that any surface reaches
    Triangle compressed = triangle_of(reach, residual);
    seen = std::move(compressed.rotated);
    reach = std::move(compressed.r);
    unreached = residual.squaredNorm() - seen.squaredNorm();
    unreached_count = static_cast<double>(left - size());
  }

  const bool compressed = left > size();
  const SeenPriors of_triangle = compressed ? seen_by(reach) : SeenPriors{};
  const SeenPriors* priors = &of_triangle;
  if (!compressed) {
    const auto same = std::find_if(known.begin(), known.end(), [&](const SeenPriors& one) {
      return one.reach.rows() == data.reach.rows() && one.reach == data.reach;
    });
    priors = same != known.end() ? &*same : &known.emplace_back(seen_by(data.reach));
  }
  double stroke = 1.0, velocity = 1.0;  // of the likeliest prior
  Likeliest best;
  for (std::size_t k = 0; k < priors->seen.size(); ++k) {
    MatrixXd prior = priors->seen[k];
    if (!compressed)
      prior = qr.rotated(MatrixXd(qr.rotated(prior).transpose())).bottomRightCorner(left, left);
    const Likeliest found =
        likeliest({tridiagonal_of(prior, seen), unreached, unreached_count}, least_noise);
    if (found.evidence <= best.evidence) continue;
    best = found;
    stroke = kSmooth[k / std::size(kSmooth)];
    velocity = kSmooth[k % std::size(kSmooth)];
  }
  const double tall = best.size, noise = best.noise;
  // Posterior over the coefficients: their prior is root root'.
  const MatrixXd root = Cholesky(tall * covariance(stroke, velocity)).root();
  const MatrixXd through = reach * root;
  MatrixXd precision = through.transpose() * through / noise;
  precision.diagonal().array() += 1.0;
  const Cholesky factor(precision);
  SurfaceFit fit;
  fit.mean = root * factor.solve(VectorXd(through.transpose() * seen)) / noise;
  fit.root = factor.whiten(MatrixXd(root.transpose())).transpose();
  const double before = residual.squaredNorm();
  const double after = (seen - reach * fit.mean).squaredNorm() + unreached;
  fit.share = before > 0.0 ? std::clamp(1.0 - after / before, 0.0, 1.0) : 0.0;
  return fit;
}

}  // namespace shaker::estimator::diagnosis
