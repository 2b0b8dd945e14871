#include "estimator/signal/stationarity.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "estimator/signal/cycle_courses.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTrendProbability = 1e-3;
constexpr double kSubharmonicProbability = 1e-6;

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

// The cycles without their mean and the courses, and how their scatter splits.
struct Rest {
  MatrixXd cycles;
  CycleCourses::Split split;
};

Rest rest_beside(const CycleCourses& courses, const MatrixXd& cycles) {
  Rest rest{cycles, {}};
  for (Index c = 0; c < cycles.cols(); ++c)
    rest.split += courses.take_out({rest.cycles.col(c).data(), courses.cycles()});
  return rest;
}

// How much of where the samples lie follows the courses; at most the number of cycles.
CycleCourses::Split offsets_along(const CycleCourses& courses, const std::vector<double>& offsets) {
  CycleCourses::Split split;
  for (const double quarter : {0.0, 0.25}) {
    std::vector<double> turned;
    for (const double offset : offsets)
      turned.push_back(std::cos(2.0 * std::numbers::pi * (offset - quarter)));
    split += courses.take_out(turned);
  }
  return split;
}

double chance_of(const CycleCourses& courses, const MatrixXd& scaled, const VectorXd& scale,
                 const ExpectedScatter& expected) {
  double square = expected.rounding * expected.rounding;
  if (static_cast<Index>(expected.offsets.size()) == scaled.rows())
    square += expected.sampling * expected.sampling *
              offsets_along(courses, expected.offsets).follows /
              static_cast<double>(courses.courses());
  const auto components = static_cast<double>(scaled.cols());
  return courses.by_chance(rest_beside(courses, scaled).split, components,
                           square * scale.cwiseInverse().squaredNorm() / components);
}

// The expectation for the last cycles.
ExpectedScatter of_last(ExpectedScatter expected, Index cycles) {
  auto& offsets = expected.offsets;
  const auto first = static_cast<std::ptrdiff_t>(offsets.size()) - cycles;
  if (first > 0) offsets.erase(offsets.begin(), offsets.begin() + first);
  return expected;
}

// Standard deviation of a component that is expected of all cycles.
double expected_of_all(const ExpectedScatter& expected) {
  const auto n = expected.offsets.size();
  if (n == 0) return expected.rounding;
  const double lie_apart = offsets_along(CycleCourses(n), expected.offsets).rest;
  return std::hypot(expected.rounding,
                    expected.sampling * std::sqrt(lie_apart / static_cast<double>(n)));
}

double trend_probability(const MatrixXd& scaled, const VectorXd& scale,
                         const ExpectedScatter& expected) {
  return chance_of(CycleCourses::trend(static_cast<std::size_t>(scaled.rows())), scaled, scale,
                   of_last(expected, scaled.rows()));
}

// Cycles that are dropped beside the transient, where so many are left that they can be spared.
constexpr Index kCyclesOfSunkTransient = 2, kMinCyclesToSpare = 8;
constexpr double kDyingProbability = 0.01;
// The decays that are tried: from one that leaves this share from the first cycle to the last.
constexpr double kMaxRemainingShare = 0.25, kStepOfDecay = 0.95;
constexpr int kDecays = 20;
constexpr double kMaxDetuning = 0.6, kStepOfDetuning = 0.05;  // rad a cycle

// Cosine and sine of a turn of `angle` a cycle, which shrink by `decay` with every one. A turn of pi
// that lasts is a cosine alone.
CycleCourses turning(Index cycles, double decay, double angle) {
  std::vector<std::vector<double>> courses(2);
  for (Index k = 0; k < cycles; ++k) {
    const auto cycle = static_cast<double>(k);
    const double size = std::pow(decay, cycle);
    courses[0].push_back(size * std::cos(angle * cycle));
    courses[1].push_back(size * std::sin(angle * cycle));
  }
  if (decay == 1.0 && angle == std::numbers::pi) courses.pop_back();
  return CycleCourses(static_cast<std::size_t>(cycles), courses);
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

struct Turning {
  CycleCourses courses;
  Rest rest;
  double decay = 1.0;
};

Turning best_turning(const MatrixXd& cycles, double angle) {
  const Index n = cycles.rows();
  const double slowest = std::pow(kMaxRemainingShare, 1.0 / static_cast<double>(n - 1));
  const CycleCourses lasting = turning(n, 1.0, angle);
  Turning best{lasting, rest_beside(lasting, cycles), 1.0};
  for (int d = 0; d < kDecays; ++d) {
    const double decay = slowest * std::pow(kStepOfDecay, d);
    for (double aside = -kMaxDetuning; aside <= kMaxDetuning; aside += kStepOfDetuning) {
      const CycleCourses courses = turning(n, decay, angle + aside);
      Rest rest = rest_beside(courses, cycles);
      if (rest.split.rest < best.rest.split.rest) best = {courses, std::move(rest), decay};
    }
  }
  return best;
}

// A subharmonic is locked to the excitation and lasts; the rest of a transient near that part of
// its frequency shrinks and turns. Seen in the cycles' own unit: an alternation makes the scatter
// of each component about as large as itself, and in units of that, how it shrinks is lost among
// components that hardly alternate. Whether it has sunk is asked of all components alike.
Dying dies_away(const MatrixXd& cycles, const MatrixXd& scaled, double angle) {
  const auto n = static_cast<double>(cycles.rows());
  const Turning best = best_turning(cycles, angle);
  if (best.decay == 1.0) return {};
  const CycleCourses lasting = turning(cycles.rows(), 1.0, angle);
  const double p = components_of(best.rest.cycles);
  const double more = p * (2.0 - static_cast<double>(lasting.courses())) + 2.0;  // parameters
  const double left = best.rest.split.rest;
  const double gain = rest_beside(lasting, cycles).split.rest - left;
  Dying dying;
  dying.likelier =
      probability_by_chance({gain, left}, more, p * (n - 3.0) - 2.0) < kDyingProbability;
  // Shares of a geometric series.
  const CycleCourses::Split all = rest_beside(best.courses, scaled).split;
  const double ratio = best.decay * best.decay, whole = std::pow(ratio, n);
  const double last = all.follows * (1.0 - ratio) / (1.0 - whole) * whole / ratio;
  dying.sunk = last < all.rest / (n - 3.0);
  return dying;
}

}  // namespace

int cycles_of_transient(const MatrixXd& cycles, const ExpectedScatter& expected) {
  const Index n = cycles.rows();
  if (n < 4) return 0;
  const Index half = n / 2;
  const VectorXd scale = scale_of(cycles.bottomRows(n - half), expected_of_all(expected));
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
         trend_probability(scaled.bottomRows(n - drop), scale, expected) < kTrendProbability)
    ++drop;
  // What has sunk into one cycle's noise still stands out of the mean's: it goes on decaying.
  if (drop > 0 && n - drop > kMinCyclesToSpare) drop += kCyclesOfSunkTransient;
  // A trend that dropping does not cure is no transient: keep the cycles.
  if (drop == most && drop > half) drop = half;
  return static_cast<int>(std::min(drop, most));
}

Stationarity stationarity_of(const MatrixXd& cycles, const ExpectedScatter& expected) {
  Stationarity found;
  const Index n = cycles.rows();
  if (n < 5) return found;
  const VectorXd scale = scale_of(cycles, expected.rounding);
  const MatrixXd scaled = cycles * scale.cwiseInverse().asDiagonal();
  found.trend = trend_probability(scaled, scale, expected) < kTrendProbability;
  for (const int every : {2, 3, 4}) {
    if (n < 3 * every) continue;
    const auto courses = CycleCourses::repeating(static_cast<std::size_t>(n), every);
    if (chance_of(courses, scaled, scale, expected) >= kSubharmonicProbability) continue;
    const Dying dying = dies_away(cycles, scaled, 2.0 * std::numbers::pi / every);
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

}  // namespace shaker::estimator
