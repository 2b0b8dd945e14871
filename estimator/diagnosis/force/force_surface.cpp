#include "estimator/diagnosis/force/internal/force_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/math/dense_product.hpp"
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
constexpr double kLeastRatio = 1e-12, kLargestRatio = 1e6;  // of noise to the prior's largest
constexpr double kRatioStep = 3.0;                          // from one to the next
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

// The largest eigenvalue, by bisection: x is larger where all pivots of prior - x are negative.
double largest_of(const Tridiagonal& prior) {
  const VectorXd &diagonal = prior.diagonal(), &beside = prior.beside();
  double low = diagonal.maxCoeff();
  double high = low + 2.0 * (beside.size() > 0 ? beside.cwiseAbs().maxCoeff() : 0.0);
  for (int halved = 0; halved < kHalvings; ++halved) {
    const double x = 0.5 * (low + high);
    double pivot = diagonal[0] - x;
    for (Index k = 1; k < diagonal.size() && pivot < 0.0; ++k)
      pivot = diagonal[k] - x - beside[k - 1] * beside[k - 1] / pivot;
    (pivot < 0.0 ? high : low) = x;
  }
  return std::max(high, 1e-300);
}

// Nuisances and, last, the residual in a prior's directions, and what of them no surface reaches.
struct Beside {
  MatrixXd rotated, unreached;   // the second: their products
  double unreached_count = 0.0;  // directions
  double count = 0.0;            // of all directions, less the nuisances
};

// For some ratios of noise to prior at once, as each pivot waits for a division by the one before:
// the logarithm of the restricted likelihood's determinant, and the residual's square.
struct RatioSums {
  double log_size[kRatios], square[kRatios];
};

// products += what the columns have with each other by the inverse of prior + ratio; `pivots`: the
// logarithm of its determinant.
SHAKER_SIMD_CLONES void add_products(const SeenPrior& prior, const MatrixXd& columns,
                                     const double* __restrict ratios, double* __restrict along,
                                     double* __restrict products, double* __restrict pivots) {
  const double* diagonal = prior.seen.diagonal().data();
  const double* beside = prior.seen.beside().data();
  const Index n = columns.rows(), count = columns.cols();
  const double scale = 1.0 / prior.largest;
  double pivot[kRatios], product[kRatios], inverse[kRatios], factor[kRatios];
  for (int r = 0; r < kRatios; ++r)
    pivot[r] = product[r] = 1.0;
  for (Index k = 0; k < n; ++k) {
    const double off = k > 0 ? beside[k - 1] * scale : 0.0;
    for (int r = 0; r < kRatios; ++r) {
      factor[r] = off / pivot[r];
      // Rounding may take it below what the noise alone makes of it.
      pivot[r] = std::max(diagonal[k] * scale + ratios[r] - factor[r] * off, ratios[r]);
      inverse[r] = 1.0 / pivot[r];
      product[r] *= pivot[r];
    }
    double* to = products;
    for (Index a = 0; a < count; ++a) {
      double* mine = along + a * kRatios;
      double weighed[kRatios];
      for (int r = 0; r < kRatios; ++r) {
        mine[r] = columns(k, a) - factor[r] * mine[r];
        weighed[r] = mine[r] * inverse[r];
      }
      for (Index b = 0; b <= a; ++b, to += kRatios) {
        for (int r = 0; r < kRatios; ++r)
          to[r] += weighed[r] * along[b * kRatios + r];
      }
    }
    if (k % kFactors != kFactors - 1 && k + 1 < n) continue;
    for (int r = 0; r < kRatios; ++r) {
      pivots[r] += std::log(product[r]);
      product[r] = 1.0;
    }
  }
}

// Eliminates the nuisances from their products with the residual, row after row of the lower half.
RatioSums sums_at(const SeenPrior& prior, const Beside& beside, const double* ratios) {
  const Index count = beside.rotated.cols();
  RatioSums sum{};
  std::vector<double> along(static_cast<std::size_t>(count * kRatios), 0.0);
  std::vector<double> products(static_cast<std::size_t>(count * (count + 1) / 2 * kRatios), 0.0);
  add_products(prior, beside.rotated, ratios, along.data(), products.data(), sum.log_size);
  const auto at = [&](Index a, Index b, int r) -> double& {
    return products[static_cast<std::size_t>((a * (a + 1) / 2 + b) * kRatios + r)];
  };
  for (int r = 0; r < kRatios; ++r) {
    sum.log_size[r] += beside.unreached_count * std::log(ratios[r]);
    for (Index a = 0; beside.unreached_count > 0.0 && a < count; ++a) {
      for (Index b = 0; b <= a; ++b)
        at(a, b, r) += beside.unreached(a, b) / ratios[r];
    }
    for (Index j = 0; j + 1 < count; ++j) {
      sum.log_size[r] += std::log(std::max(at(j, j, r), 1e-300));
      for (Index a = j + 1; a < count; ++a) {
        const double factor = at(a, j, r) / std::max(at(j, j, r), 1e-300);
        for (Index b = j + 1; b <= a; ++b)
          at(a, b, r) -= factor * at(b, j, r);
      }
    }
    sum.square[r] = std::max(at(count - 1, count - 1, r), 0.0);
  }
  return sum;
}

// The likeliest size of a prior, and noise. For each ratio of the two the size is known.
struct Likeliest {
  double evidence = -std::numeric_limits<double>::infinity(), size = 1.0, noise = 1.0;
};

void look_between(const SeenPrior& prior, const Beside& beside, double least_noise, double first,
                  double step, Likeliest& best) {
  double ratios[kRatios];
  for (int r = 0; r < kRatios; ++r)
    ratios[r] = first * std::pow(step, r);
  const RatioSums sum = sums_at(prior, beside, ratios);
  for (int r = 0; r < kRatios; ++r) {
    const double size = std::max({sum.square[r] / beside.count, least_noise / ratios[r], 1e-300});
    const double evidence =
        -0.5 * (beside.count * std::log(size) + sum.log_size[r] + sum.square[r] / size);
    if (evidence > best.evidence) best = {evidence, size, ratios[r] * size};
  }
}

Likeliest likeliest(const SeenPrior& prior, const Beside& beside, double least_noise) {
  Likeliest best;
  const double next = std::pow(kRatioStep, kRatios);
  for (double first = kLeastRatio; first < kLargestRatio; first *= next)
    look_between(prior, beside, least_noise, first, kRatioStep, best);
  const double finer = std::pow(kRatioStep, 2.0 / (kRatios + 1));
  look_between(prior, beside, least_noise, best.noise / best.size / kRatioStep * finer, finer,
               best);
  best.size /= prior.largest;
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
  SeenPriors of;
  of.reach = of.inside = reach;
  if (reach.rows() > size()) {
    of.reached.emplace(reach);
    of.inside = of.reached->r();
  }
  const MatrixXd even = of.inside.leftCols(kEven), jump = of.inside.rightCols(kAcross);
  for (const double along_stroke : kSmooth) {
    for (const double along_velocity : kSmooth) {
      const MatrixXd prior = covariance(along_stroke, along_velocity);
      const MatrixXd seen_even = product(even, prior.topLeftCorner(kEven, kEven)),
                     seen_jump = product(jump, prior.bottomRightCorner(kAcross, kAcross));
      const Tridiagonal seen(product(seen_even, even.transpose()) +
                             product(seen_jump, jump.transpose()));
      of.priors.push_back({along_stroke, along_velocity, largest_of(seen), seen, {}, {}, {}});
    }
  }
  return of;
}

SurfaceFit ForceSurface::fit(const SurfaceData& data, double least_noise, SeenPriors& known) const {
  if (known.reach.rows() != data.reach.rows() || known.reach != data.reach) {
    const int points = known.points;
    known = seen_by(data.reach);
    known.points = points;
  }
  // The residual beside all that the nuisances can do.
  MatrixXd nuisance = data.nuisance;
  for (Index k = 0; k < nuisance.cols(); ++k) {
    const double norm = nuisance.col(k).norm();
    if (norm > 0.0) nuisance.col(k) /= norm;
  }
  PivotedQr qr(nuisance);
  qr.set_threshold(1e-9);
  const Index rank = qr.rank();
  const MatrixXd basis = qr.basis(rank);
  const VectorXd residual = data.residual - basis * (basis.transpose() * data.residual);
  MatrixXd columns(residual.size(), rank + 1);
  columns << basis, residual;
  if (known.reached) columns = known.reached->rotated(columns);
  const MatrixXd reached = columns.topRows(known.inside.rows());
  const MatrixXd rest = columns.bottomRows(columns.rows() - reached.rows());
  Beside beside{{},
                rest.transpose() * rest,
                static_cast<double>(rest.rows()),
                static_cast<double>(columns.rows() - rank)};
  SeenPrior* smooth = &known.priors.front();
  Likeliest best;
  for (SeenPrior& prior : known.priors) {
    beside.rotated = prior.seen.rotated(reached);
    const Likeliest found = likeliest(prior, beside, least_noise);
    if (found.evidence <= best.evidence) continue;
    best = found;
    smooth = &prior;
  }
  if (smooth->root.size() == 0) {
    smooth->root = Cholesky(covariance(smooth->along_stroke, smooth->along_velocity)).root();
    smooth->through = product(known.inside, smooth->root);
    smooth->gram = product_with_own(smooth->through.transpose());
  }
  // Posterior over the coefficients: their prior is root root'.
  const double deviation = std::sqrt(best.size);
  const MatrixXd root = deviation * smooth->root, through = deviation * smooth->through;
  const MatrixXd imitated = reached.leftCols(rank).transpose() * through;
  const MatrixXd precision =
      MatrixXd::Identity(size(), size()) +
      (best.size * smooth->gram - product_with_own(imitated.transpose())) / best.noise;
  const Cholesky factor(precision);
  SurfaceFit fit;
  const VectorXd moved =
      factor.solve(VectorXd(through.transpose() * reached.col(rank))) / best.noise;
  fit.mean = root * moved;
  fit.spread = factor.whiten(MatrixXd(root.transpose()));
  const double before = residual.squaredNorm();
  const double after = (reached.col(rank) - through * moved).squaredNorm() -
                       (imitated * moved).squaredNorm() + rest.col(rank).squaredNorm();
  fit.share = before > 0.0 ? std::clamp(1.0 - after / before, 0.0, 1.0) : 0.0;
  return fit;
}

}  // namespace shaker::estimator::diagnosis
