#include "estimator/diagnosis/force/force_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kAcross = 20, kAlong = 12;  // splines over the stroke and over the velocity
constexpr double kFineSpeed = 0.15;  // of the largest: below it the axis is even, above logarithmic
constexpr double kJump = 0.01;  // of it: over which a force may jump where the motion turns round
constexpr double kSmooth[] = {0.12, 0.3, 0.8, 2.5};  // lengths of the prior, axes from 0 to 1

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

// The residuals in the directions in which a prior of one smoothness sees them, with that prior's
// variance of each; the rest is in directions that no surface reaches.
struct Trial {
  VectorXd power, along;  // squares of the residual
  double rest = 0.0, rest_count = 0.0;
};

Trial tried(const MatrixXd& prior, const MatrixXd& reach, const VectorXd& residual) {
  const Spectrum eigen = spectrum_of(reach * prior * reach.transpose());
  Trial trial;
  trial.power = eigen.values;
  trial.along = (eigen.vectors.transpose() * residual).cwiseAbs2();
  const double least = 1e-12 * trial.power.maxCoeff();
  for (Index k = 0; k < trial.power.size(); ++k) {
    if (trial.power[k] > least) continue;
    trial.power[k] = 0.0;
    trial.rest += trial.along[k];
    trial.rest_count += 1.0;
  }
  return trial;
}

double log_evidence_of(const Trial& trial, double size, double noise) {
  double sum = -0.5 * (trial.rest_count * std::log(noise) + trial.rest / noise);
  for (Index k = 0; k < trial.power.size(); ++k) {
    if (trial.power[k] == 0.0) continue;
    const double variance = size * trial.power[k] + noise;
    sum -= 0.5 * (std::log(variance) + trial.along[k] / variance);
  }
  return sum;
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

SurfaceFit ForceSurface::fit(const SurfaceData& data, double least_noise) const {
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

  double stroke = 1.0, velocity = 1.0, tall = 1.0;  // of the likeliest prior
  double noise = least_noise, most = -std::numeric_limits<double>::infinity();
  for (const double along_stroke : kSmooth) {
    for (const double along_velocity : kSmooth) {
      const MatrixXd shape = covariance(along_stroke, along_velocity);
      Trial trial = tried(shape, reach, seen);
      trial.rest += unreached;
      trial.rest_count += unreached_count;
      const double scale = 1.0 / std::max(trial.power.maxCoeff(), 1e-300);
      for (double level = least_noise; level < 1e5; level *= 1.5) {
        for (double height = 0.1 * scale; height < 1e10 * scale; height *= 3.0) {
          const double evidence = log_evidence_of(trial, height, level);
          if (evidence <= most) continue;
          most = evidence;
          noise = level;
          tall = height;
          stroke = along_stroke;
          velocity = along_velocity;
        }
      }
    }
  }
  // Posterior over the coefficients; its covariance by the eigenvectors of what is seen.
  const MatrixXd root = Cholesky(tall * covariance(stroke, velocity)).root();
  const MatrixXd through = reach * root;
  const Spectrum eigen = spectrum_of(through.transpose() * through);
  const VectorXd precision = eigen.values.cwiseMax(0.0).array() / noise + 1.0;
  const MatrixXd back = root * eigen.vectors;
  SurfaceFit fit;
  fit.mean =
      back *
      (eigen.vectors.transpose() * (through.transpose() * seen)).cwiseQuotient(noise * precision);
  fit.root = back * precision.cwiseSqrt().cwiseInverse().asDiagonal();
  const double before = residual.squaredNorm();
  const double after = (seen - reach * fit.mean).squaredNorm() + unreached;
  fit.share = before > 0.0 ? std::clamp(1.0 - after / before, 0.0, 1.0) : 0.0;
  return fit;
}

}  // namespace shaker::estimator::diagnosis
