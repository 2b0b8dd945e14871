#include "estimator/diagnosis/cycles/internal/stationarity.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/math/dense.hpp"
#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTrendProbability = 1e-3;
constexpr double kSubharmonicProbability = 1e-6;

double upper_tail(double ratio, double numerator, double denominator) {
  if (!(ratio > 0.0) || !std::isfinite(ratio)) return ratio > 0.0 ? 0.0 : 1.0;
  return fisher_f_above(ratio, numerator, denominator);
}

// Standard deviation of each component from the differences of neighbours, which a slow drift
// hardly touches; cosine and sine of a harmonic share theirs.
VectorXd scale_of(const MatrixXd& cycles, double expected) {
  const Index n = cycles.rows();
  const MatrixXd step = cycles.bottomRows(n - 1) - cycles.topRows(n - 1);
  VectorXd variance = step.colwise().squaredNorm().transpose() / (2.0 * static_cast<double>(n - 1));
  for (Index c = 1; c + 1 < variance.size(); c += 2)
    variance[c] = variance[c + 1] = 0.5 * (variance[c] + variance[c + 1]);
  const double least = 1e-20 * (1e-30 + cycles.cwiseAbs2().maxCoeff());
  return variance.cwiseMax(std::max(least, expected * expected)).cwiseSqrt();
}

// Share of the scatter that follows the given courses over the cycles, as an F test's probability.
// `least`: square of a row's scatter that is expected anyhow.
double probability_of(const MatrixXd& scaled, const MatrixXd& courses, double least) {
  const auto n = static_cast<double>(scaled.rows());
  const auto p = static_cast<double>(scaled.cols());
  const auto q = static_cast<double>(courses.cols());
  MatrixXd basis(scaled.rows(), courses.cols() + 1);
  basis << VectorXd::Ones(scaled.rows()), courses;
  const MatrixXd centred = scaled.rowwise() - scaled.colwise().mean();
  const MatrixXd left = scaled - basis * least_squares(basis, scaled);
  const double rest = left.squaredNorm();
  const double explained = centred.squaredNorm() - rest;
  const double freedom = n - 1.0 - q;
  if (freedom < 1.0) return 1.0;
  return upper_tail((explained / q) / std::max(rest / freedom, least), p * q, p * freedom);
}

double trend_probability(const MatrixXd& scaled, double least) {
  return probability_of(scaled, VectorXd::LinSpaced(scaled.rows(), -1.0, 1.0), least);
}

constexpr Index kSunk = 2, kFewestToSpare = 8;
constexpr double kDyingProbability = 0.01;
constexpr double kLasts = 0.25;  // of its size, from the first cycle to the last
constexpr int kDecays = 20;
constexpr double kFaster = 0.95;
constexpr double kAside = 0.6, kTurn = 0.05;  // rad a cycle

MatrixXd residuals(const MatrixXd& cycles, const MatrixXd& courses) {
  MatrixXd basis(cycles.rows(), courses.cols() + 1);
  basis << VectorXd::Ones(cycles.rows()), courses;
  return cycles - basis * least_squares(basis, cycles);
}

// Cosine and sine of a turn a cycle, which shrink with every one.
MatrixXd damped(Index cycles, double decay, double angle) {
  MatrixXd courses(cycles, 2);
  for (Index k = 0; k < cycles; ++k) {
    const auto cycle = static_cast<double>(k);
    const double size = std::pow(decay, cycle);
    courses(k, 0) = size * std::cos(angle * cycle);
    courses(k, 1) = size * std::sin(angle * cycle);
  }
  return courses;
}

// An oscillation that dies, said of cycles that seem to repeat only every so many of them.
struct Dying {
  bool likelier = false;  // than one that lasts
  bool sunk = false;      // in the last cycle, into what it leaves
};

// How many components share what is left of the cycles: noise of a few does not count as that of
// all.
double components_of(const MatrixXd& left) {
  const VectorXd power = left.colwise().squaredNorm().transpose();
  return power.sum() > 0.0 ? power.sum() * power.sum() / power.squaredNorm() : 1.0;
}

struct Damped {
  MatrixXd courses, left;
  double decay = 0.0;  // 0: what lasts leaves least
};

Damped best_damped(const MatrixXd& cycles, const MatrixXd& lasting, double angle) {
  const Index n = cycles.rows();
  const double slowest = std::pow(kLasts, 1.0 / static_cast<double>(n - 1));
  Damped best{lasting, residuals(cycles, lasting), 0.0};
  for (int d = 0; d < kDecays; ++d) {
    const double decay = slowest * std::pow(kFaster, d);
    for (double aside = -kAside; aside <= kAside; aside += kTurn) {
      const MatrixXd courses = damped(n, decay, angle + aside);
      const MatrixXd left = residuals(cycles, courses);
      if (left.squaredNorm() < best.left.squaredNorm()) best = {courses, left, decay};
    }
  }
  return best;
}

// A subharmonic is locked to the excitation and lasts; the rest of a transient near that part of
// its frequency shrinks and turns. Seen in the cycles' own unit: an alternation makes the scatter
// of each component about as large as itself, and in units of that, how it shrinks is lost among
// components that hardly alternate. Whether it has sunk is asked of all components alike.
Dying dies_away(const MatrixXd& cycles, const MatrixXd& scaled, const MatrixXd& lasting,
                double angle) {
  const auto n = static_cast<double>(cycles.rows());
  const Damped best = best_damped(cycles, lasting, angle);
  if (best.decay == 0.0) return {};
  const double p = components_of(best.left);
  const double more = p * static_cast<double>(2 - lasting.cols()) + 2.0;  // parameters
  const double freedom = p * (n - 3.0) - 2.0;
  const double left = best.left.squaredNorm();
  const double gain = residuals(cycles, lasting).squaredNorm() - left;
  Dying dying;
  dying.likelier = freedom >= 1.0 &&
                   upper_tail(gain / more / (left / freedom), more, freedom) < kDyingProbability;
  // Shares of a geometric series.
  const double noise = residuals(scaled, best.courses).squaredNorm();
  const double all = (scaled.rowwise() - scaled.colwise().mean()).squaredNorm();
  const double ratio = best.decay * best.decay, whole = std::pow(ratio, n);
  const double last = (all - noise) * (1.0 - ratio) / (1.0 - whole) * whole / ratio;
  dying.sunk = last < noise / (n - 3.0);
  return dying;
}

}  // namespace

int cycles_of_transient(const MatrixXd& cycles, double least) {
  const Index n = cycles.rows();
  if (n < 4) return 0;
  const Index half = n / 2;
  const VectorXd scale = scale_of(cycles.bottomRows(n - half), least);
  const double expected = (least * scale.cwiseInverse()).squaredNorm();
  const MatrixXd scaled = cycles * scale.cwiseInverse().asDiagonal();
  const Eigen::RowVectorXd reference = scaled.bottomRows(n - half).colwise().mean();
  const auto p = static_cast<double>(cycles.cols());
  // The scale is itself an estimate: of so many degrees of freedom from neighbours' differences.
  const auto late = static_cast<double>(n - half);
  const double freedom = std::max(2.5, 1.3 * (late - 1.0));
  const double limit =
      freedom / (freedom - 2.0) * (1.0 + 1.0 / late) * (p + 6.0 * std::sqrt(2.0 * p));
  const Index most = std::min<Index>(2 * n / 3, n - 3);
  Index drop = 0;
  for (Index k = 0; k < half; ++k) {
    if ((scaled.row(k) - reference).squaredNorm() > limit) drop = k + 1;
  }
  while (drop < most && n - drop > 4 &&
         trend_probability(scaled.bottomRows(n - drop), expected) < kTrendProbability)
    ++drop;
  // What has sunk into one cycle's noise still stands out of the mean's: it goes on decaying.
  if (drop > 0 && n - drop > kFewestToSpare) drop += kSunk;
  // A trend that dropping does not cure is no transient: keep the cycles.
  if (drop == most && drop > half) drop = half;
  return static_cast<int>(std::min(drop, most));
}

Stationarity examine(const MatrixXd& cycles, double least) {
  Stationarity found;
  const Index n = cycles.rows();
  if (n < 5) return found;
  const VectorXd scale = scale_of(cycles, least);
  const MatrixXd scaled = cycles * scale.cwiseInverse().asDiagonal();
  const double expected = (least * scale.cwiseInverse()).squaredNorm();
  found.trend = trend_probability(scaled, expected) < kTrendProbability;
  for (const int every : {2, 3, 4}) {
    if (n < 3 * every) continue;
    MatrixXd courses(n, every == 2 ? 1 : 2);
    for (Index c = 0; c < courses.cols(); ++c) {
      for (Index k = 0; k < n; ++k)
        courses(k, c) = harmonic_term(static_cast<int>(c) + 1, static_cast<int>(k), every);
    }
    if (probability_of(scaled, courses, expected) >= kSubharmonicProbability) continue;
    const Dying dying = dies_away(cycles, scaled, courses, 2.0 * std::numbers::pi / every);
    if (dying.likelier && dying.sunk) {
      found.trend = true;
      continue;
    }
    found.dying = dying.likelier;
    found.subharmonic = every;
    break;
  }
  return found;
}

}  // namespace shaker::estimator::diagnosis
