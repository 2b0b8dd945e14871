#include "estimator/diagnosis/noise/internal/remaining_transient.hpp"

#include <cmath>
#include <complex>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/solve/periodic/floquet.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kModesTo =
    1e-4;                       // error of the modes over a period: what decays faster is not told
constexpr double kDead = 1e-3;  // of a cycle's disturbance in the next one: nothing is left

// Largest transient that one expects in what passes for steady, of the response's own size. Only
// says what a mode is worth that the cycles do not tell.
constexpr double kLargest = 0.1;

constexpr double kLinear = 0.2;      // of the mean's noise: so much of its square may be left
constexpr double kSquareLeft = 0.3;  // of it, after a course of any shape was taken out
constexpr Eigen::Index kFewestForSquare = 5;

// Weights of the cycles whose sum is the steady one when the cycles hold `course` besides, in any
// shape; with `left` as the courses' projection that leaves neither.
struct Steady {
  VectorXd weight;
  MatrixXd left;
};

Steady steady_weights(Index cycles, const VectorXd* course) {
  MatrixXd known = MatrixXd::Ones(cycles, course != nullptr ? 2 : 1);
  if (course != nullptr) known.col(1) = *course;
  const MatrixXd inverse = Ldlt(known.transpose() * known).solve(MatrixXd(known.transpose()));
  return {inverse.row(0), MatrixXd::Identity(cycles, cycles) - known * inverse};
}

// `with_square`: of the disturbances too, which fall by the square of the slowest mode's
// multiplier and may have any shape.
WithoutTransient less_modes(const MatrixXd& cycles, const DecayingModes& modes,
                            const VectorXd& variance, bool with_square) {
  const Index size = cycles.cols(), n = cycles.rows();
  WithoutTransient out{cycles, MatrixXd::Zero(size, size), VectorXd::Zero(size), 0.0};
  if (static_cast<Index>(modes.of_cycle.size()) != n) return out;
  VectorXd course(n);
  for (Index k = 0; k < n; ++k)
    course[k] = std::pow(modes.slowest, 2.0 * static_cast<double>(k));
  const Steady steady = steady_weights(n, with_square ? &course : nullptr);
  const MatrixXd left = steady.left * cycles;
  const Index count = modes.of_cycle.front().cols();
  const VectorXd weight = variance.cwiseInverse();
  const double expected = kLargest * cycles.colwise().mean().tail(size - 1).norm();
  MatrixXd normal = MatrixXd::Identity(count, count) / (expected * expected + 1e-300);
  VectorXd along = VectorXd::Zero(count);
  MatrixXd in_steady = MatrixXd::Zero(size, count);
  std::vector<MatrixXd> apart(modes.of_cycle.size(), MatrixXd::Zero(size, count));
  for (Index k = 0; k < n; ++k) {
    MatrixXd& own = apart[static_cast<std::size_t>(k)];
    for (Index l = 0; l < n; ++l)
      own += steady.left(k, l) * modes.of_cycle[static_cast<std::size_t>(l)];
    const MatrixXd weighted = weight.asDiagonal() * own;
    normal += own.transpose() * weighted;
    along += weighted.transpose() * left.row(k).transpose();
    in_steady += steady.weight[k] * modes.of_cycle[static_cast<std::size_t>(k)];
  }
  const Ldlt factors(normal);
  const VectorXd amplitude = factors.solve(along);
  const MatrixXd covariance = factors.solve(MatrixXd(MatrixXd::Identity(count, count)));
  if (!amplitude.allFinite() || !covariance.allFinite()) return out;
  if (with_square) out.spent.setOnes();
  for (Index k = 0; k < n; ++k) {
    out.cycles.row(k) -= (modes.of_cycle[static_cast<std::size_t>(k)] * amplitude).transpose();
    const MatrixXd& own = apart[static_cast<std::size_t>(k)];
    out.spent += (own * covariance).cwiseProduct(own).rowwise().sum().cwiseProduct(weight);
  }
  out.first = (modes.of_cycle.front() * amplitude).norm();
  // What is left has the steady cycle as its mean, and the scatter about both courses.
  const Eigen::RowVectorXd mean = steady.weight.transpose() * out.cycles;
  out.cycles = (steady.left * out.cycles).rowwise() + mean;
  out.added = in_steady * covariance * in_steady.transpose();
  out.added.diagonal() += (steady.weight.squaredNorm() - 1.0 / static_cast<double>(n)) * variance;
  // Of the square, in a shape that nobody knows, and of what is left of it once it was taken out.
  const double square = std::pow(out.first, 2) / cycles.colwise().mean().tail(size - 1).norm();
  const double left_of_it = (with_square ? kSquareLeft : 1.0) * square * course.mean();
  out.added.diagonal().array() += left_of_it * left_of_it;
  return out;
}

}  // namespace

DecayingModes decaying_modes(const Prediction& prediction, const std::vector<double>& theta,
                             int harmonics, int cycles) {
  if (prediction.response() == nullptr) return {};
  PeriodicSystem system = prediction.response()->anew();
  if (!system.linearise(theta)) return {};
  const auto modes = floquet_modes(system, theta, kModesTo);
  if (!modes || modes->empty() || !(std::abs(modes->front().multiplier) < 1.0)) return {};
  const MatrixXd analysis = analysis_matrix(harmonics, prediction.points());
  DecayingModes all;
  all.slowest = std::abs(modes->front().multiplier);
  all.of_cycle.assign(static_cast<std::size_t>(cycles), MatrixXd(harmonic_size(harmonics), 0));
  for (const FloquetMode& mode : *modes) {
    if (std::abs(mode.multiplier) < kDead) continue;
    const Eigen::Map<const Eigen::VectorXcd> shape(mode.shape.data(),
                                                   static_cast<Index>(mode.shape.size()));
    Eigen::VectorXcd seen = analysis * shape;
    const double length = seen.norm();
    if (!(length > 0.0) || !std::isfinite(length)) continue;
    seen /= length;
    const Index wide = mode.multiplier.imag() > 0.0 ? 2 : 1;
    for (MatrixXd& cycle : all.of_cycle) {
      const Index at = cycle.cols();
      cycle.conservativeResize(Eigen::NoChange, at + wide);
      cycle.col(at) = seen.real();
      if (wide == 2) cycle.col(at + 1) = -seen.imag();
      seen *= mode.multiplier;
    }
  }
  return all;
}

WithoutTransient without_transient(const MatrixXd& cycles, const DecayingModes& modes,
                                   const VectorXd& variance) {
  WithoutTransient out = less_modes(cycles, modes, variance, false);
  const Index size = cycles.cols();
  // A disturbance's square over the motion's size is what the linear modes leave.
  const double square = std::pow(out.first, 2) / (cycles.colwise().mean().tail(size - 1).norm());
  const double noise = std::sqrt(variance.mean() / static_cast<double>(cycles.rows()));
  if (square > kLinear * noise && cycles.rows() > kFewestForSquare)
    out = less_modes(cycles, modes, variance, true);
  return out;
}

}  // namespace shaker::estimator::diagnosis
