#include "estimator/diagnosis/score/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRankTolerance = 1e-9;

// Probability of at least `value`, from ascending draws; beyond all but the last 1 % of them by a
// gamma distribution through their mean and variance, whichever is larger at the joint.
double tail(const std::vector<double>& draws, double value) {
  const auto count = static_cast<double>(draws.size());
  const auto above =
      static_cast<double>(draws.end() - std::lower_bound(draws.begin(), draws.end(), value));
  if (above >= 0.01 * count) return above / count;
  // Exponential decay beyond the 99 % point, at the rate of the last percent.
  const auto at = static_cast<std::size_t>(0.99 * count);
  const double joint = draws[at];
  double mean = 0.0;
  for (std::size_t i = at; i < draws.size(); ++i)
    mean += (draws[i] - joint) / static_cast<double>(draws.size() - at);
  if (!(mean > 0.0)) return 0.0;
  return 0.01 * std::exp(-(value - joint) / mean);
}

}  // namespace

Projector::Projector(const MatrixXd& jacobian) {
  if (jacobian.cols() == 0) {
    basis_.resize(jacobian.rows(), 0);
    return;
  }
  MatrixXd unit = jacobian;
  for (Index k = 0; k < unit.cols(); ++k) {
    const double length = unit.col(k).norm();
    if (length > 0.0) unit.col(k) /= length;
  }
  const PivotedQr qr(unit);
  Index rank = 0;
  const VectorXd diagonal = qr.pivots();
  while (rank < diagonal.size() && std::fabs(diagonal[rank]) > kRankTolerance)
    ++rank;
  basis_ = qr.basis(rank);
}

MatrixXd Projector::operator()(const MatrixXd& columns) const {
  return columns - basis_ * (basis_.transpose() * columns);
}

double gain_of(const Signature& signature, const VectorXd& residual) {
  const double along = signature.direction.dot(residual);
  if (signature.sign != 0 && along * signature.sign < 0.0) return 0.0;
  return along * along;
}

Calibration::Calibration(const Design& design, int draws, std::uint64_t seed) {
  const Index n = design.freedom.size();
  std::vector<const Signature*> seen;
  for (const Signature& s : design.signatures) {
    if (s.direction.size() == n && s.visible > 0.0) seen.push_back(&s);
  }
  MatrixXd directions(n, static_cast<Index>(seen.size()));
  for (std::size_t k = 0; k < seen.size(); ++k)
    directions.col(static_cast<Index>(k)) = seen[k]->direction;
  const Projector project(design.jacobian);
  std::mt19937_64 source(seed);
  std::normal_distribution<double> normal;
  constexpr Index kBlock = 256;
  for (Index done = 0; done < draws; done += kBlock) {
    MatrixXd noise(n, kBlock);
    for (Index d = 0; d < kBlock; ++d) {
      for (Index i = 0; i < n; ++i) {
        // Cosine and sine of a harmonic share one estimated variance. Wilson and Hilferty's cube
        // of a normal variate is chi-squared / freedom to a part in a thousand from four on.
        if (i == 0 || design.freedom[i] != design.freedom[i - 1] || (i % 2) == 1) {
          const double c = 2.0 / (9.0 * design.freedom[i]);
          const double root = std::max(1.0 - c + std::sqrt(c) * normal(source), 0.1);
          noise(i, d) = 1.0 / std::sqrt(root * root * root);
        } else {
          noise(i, d) = noise(i - 1, d);
        }
      }
      for (Index i = 0; i < n; ++i)
        noise(i, d) *= normal(source);
    }
    const MatrixXd residual = project(noise);
    const MatrixXd along = directions.transpose() * residual;
    for (Index d = 0; d < kBlock && done + d < draws; ++d) {
      lengths_.push_back(residual.col(d).squaredNorm());
      double best = 0.0;
      for (Index k = 0; k < along.rows(); ++k) {
        const int sign = seen[static_cast<std::size_t>(k)]->sign;
        if (sign == 0 || along(k, d) * sign > 0.0) best = std::max(best, along(k, d) * along(k, d));
      }
      gains_.push_back(best);
    }
  }
  const std::vector<double> lengths = lengths_;
  const std::vector<double> gains = gains_;
  std::sort(lengths_.begin(), lengths_.end());
  std::sort(gains_.begin(), gains_.end());
  for (std::size_t d = 0; d < lengths.size(); ++d)
    smaller_.push_back(std::min(of_length(lengths[d]), of_best_gain(gains[d])));
  std::sort(smaller_.begin(), smaller_.end());
}

double Calibration::of_length(double chi_squared) const {
  return tail(lengths_, chi_squared);
}

double Calibration::of_best_gain(double gain) const {
  return gains_.back() > 0.0 ? tail(gains_, gain) : 1.0;
}

double Calibration::combined(double chi_squared, double gain) const {
  const double p = std::min(of_length(chi_squared), of_best_gain(gain));
  const auto below =
      static_cast<double>(std::upper_bound(smaller_.begin(), smaller_.end(), p) - smaller_.begin());
  const double count = static_cast<double>(smaller_.size());
  // Two looks at the data double a small probability at the most.
  return below >= 0.005 * count ? below / count : std::min(2.0 * p, 0.005);
}

}  // namespace shaker::estimator::diagnosis
