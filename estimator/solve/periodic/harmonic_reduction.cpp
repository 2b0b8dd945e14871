#include "estimator/solve/periodic/internal/harmonic_reduction.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/dense.hpp"
#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator {
namespace {

// Grid points for each harmonic kept. Cubic forces need four to avoid aliasing. Forces that are not
// polynomials have further harmonics; eight keep their aliasing below the truncation error.
constexpr int kPointsPerHarmonic = 8;
constexpr int kFewestPoints = 64;
// Harmonics beyond those kept that the error estimate uses, as a multiple of those kept.
constexpr int kLookAhead = 2;

}  // namespace

std::string ReducedSolution::sentence() const {
  if (status != SolveStatus::converged)
    return fmt::format("no periodic solution with {} harmonics: {}", harmonics,
                       SolveReport{status}.sentence());
  if (sufficient) return fmt::format("{} harmonics are enough", harmonics);
  return fmt::format(
      "{} harmonics leave {:.1e} of the motion out: the forces do not vary slowly here; solve on "
      "the grid instead",
      harmonics, left_out);
}

HarmonicReduction::HarmonicReduction(const Model& model, ReductionOptions options)
    : model_(&model), options_(options) {
  if (options.least < 1 || options.most < options.least || !(options.accuracy > 0.0))
    throw std::invalid_argument(
        fmt::format("a harmonic reduction takes 1 <= least <= most harmonics and a positive "
                    "accuracy, not {}..{} and {}",
                    options.least, options.most, options.accuracy));
  resize(options.least);
}

void HarmonicReduction::set_excitation(double frequency_hz, double amplitude) {
  frequency_ = frequency_hz;
  amplitude_ = amplitude;
  grid_->set_excitation(frequency_hz, amplitude);
}

void HarmonicReduction::resize(int harmonics) {
  const int s = model_->coordinates(), m = 2 * harmonics + 1, before = 2 * harmonics_ + 1;
  Eigen::MatrixXd grown = Eigen::MatrixXd::Zero(m * s, 1 + model_->parameter_count());
  for (int c = 0; harmonics_ > 0 && c < s; ++c)
    grown.middleRows(c * m, std::min(m, before)) =
        unknowns_.middleRows(c * before, std::min(m, before));
  unknowns_ = std::move(grown);
  harmonics_ = harmonics;

  const int n = std::max(kFewestPoints, kPointsPerHarmonic * harmonics);
  grid_ = std::make_unique<PeriodicSystem>(*model_, GridOptions{Scheme::fourier, n, false});
  grid_->set_excitation(frequency_, amplitude_);
  basis_.resize(n, m);
  first_.setZero(n, m);
  second_.setZero(n, m);
  for (int term = 0; term < m; ++term)
    for (int i = 0; i < n; ++i)
      basis_(i, term) = harmonic_term(term, i, n);
  for (int h = 1; h <= harmonics; ++h) {
    const double order = h;
    first_.col(2 * h - 1) = -order * basis_.col(2 * h);
    first_.col(2 * h) = order * basis_.col(2 * h - 1);
    second_.middleCols(2 * h - 1, 2) = -order * order * basis_.middleCols(2 * h - 1, 2);
  }
}

// Evaluates the state and the equations on the grid and projects them on the harmonics.
bool HarmonicReduction::linearise(std::span<const double> theta) {
  const int s = model_->coordinates(), n = grid_->points(), m = 2 * harmonics_ + 1;
  for (int c = 0; c < s; ++c) {
    const Eigen::VectorXd z = basis_ * unknowns_.col(0).segment(c * m, m);
    for (int i = 0; i < n; ++i)
      grid_->state()[static_cast<std::size_t>(i * s + c)] = z[i];
  }
  if (!grid_->linearise(theta)) return false;
  const int p = model_->parameter_count();
  const double w = kTwoPi * frequency_;
  jacobian_.resize(m * s, m * s);
  right_.resize(m * s, 1 + p);
  Eigen::VectorXd values(n);
  Eigen::MatrixXd slope(n, m);
  for (int e = 0; e < s; ++e) {
    for (int k = -1; k < p; ++k) {
      for (int i = 0; i < n; ++i)
        values[i] = k < 0 ? grid_->g(i, e) : grid_->g_theta(i, e, k);
      right_.col(1 + k).segment(e * m, m) = basis_.transpose() * values / n;
    }
    for (int c = 0; c < s; ++c) {
      for (int i = 0; i < n; ++i)
        slope.row(i) = grid_->g_u(i, e, c) * basis_.row(i) +
                       grid_->g_v(i, e, c) * w * first_.row(i) +
                       grid_->g_a(i, e, c) * w * w * second_.row(i);
      jacobian_.block(e * m, c * m, m, m) = basis_.transpose() * slope / n;
    }
  }
  return true;
}

// Iterates damped Newton on the harmonics. The last step also gives the sensitivities.
SolveReport HarmonicReduction::newton(std::span<const double> theta) {
  SolveReport report;
  constexpr int kMostRounds = 40;
  if (!linearise(theta)) return {SolveStatus::inadmissible};
  for (; report.iterations < kMostRounds; ++report.iterations) {
    const double size = right_.col(0).norm();
    const Eigen::MatrixXd solved = -solve_square(jacobian_, right_);
    if (!solved.allFinite()) return {SolveStatus::singular, report.iterations};
    unknowns_.rightCols(unknowns_.cols() - 1) = solved.rightCols(solved.cols() - 1);
    const Eigen::VectorXd step = solved.col(0), from = unknowns_.col(0);
    if (step.norm() <= 1e-13 * (1e-9 + from.norm())) return report;
    double share = 1.0;
    for (; share > 1e-6; share /= 2.0) {
      unknowns_.col(0) = from + share * step;
      if (linearise(theta) && right_.col(0).norm() <= (1.0 - 1e-4 * share) * size) break;
    }
    if (share > 1e-6) continue;
    unknowns_.col(0) = from;
    // The residual does not decrease any further: rounding, or no convergence.
    const bool rounding = step.norm() <= 1e-9 * (1e-9 + from.norm());
    if (!linearise(theta)) return {SolveStatus::inadmissible, report.iterations};
    return {rounding ? SolveStatus::converged : SolveStatus::no_convergence, report.iterations};
  }
  return {SolveStatus::no_convergence, report.iterations};
}

// Estimates the truncation error: the displacement that the residual's further harmonics would
// cause. At these frequencies the inertia dominates. The moduli are summed because all harmonics
// may peak at the same time.
double HarmonicReduction::left_out() const {
  const int s = model_->coordinates(), n = grid_->points();
  const double w = kTwoPi * frequency_;
  double worst = 0.0, largest = 0.0;
  for (int c = 0; c < s; ++c)
    for (int h = 1; h <= harmonics_; ++h)
      largest = std::max(largest, amplitude(h, c));
  std::vector<double> equation(static_cast<std::size_t>(n));
  for (int e = 0; e < s; ++e) {
    for (int i = 0; i < n; ++i)
      equation[static_cast<std::size_t>(i)] = grid_->g(i, e);
    double missing = 0.0;
    for (int h = harmonics_ + 1; h <= (1 + kLookAhead) * harmonics_; ++h) {
      const std::complex<double> sum = fourier_sum(equation, h, 2.0 / n);
      const double inertia = model_->mass(e, e), order = model_->order(e);
      const double answers = order == 2 ? inertia * h * h * w * w : h * w;
      if (answers > 0.0) missing += std::abs(sum) / answers;
    }
    worst = std::max(worst, missing);
  }
  return largest > 0.0 ? worst / largest : worst;
}

ReducedSolution HarmonicReduction::solve(std::span<const double> theta) {
  ReducedSolution found;
  if (!solved_) {
    const SolveReport start = grid_->solve_from_rest(theta);
    if (start.status != SolveStatus::converged) {
      found.status = start.status;
      found.harmonics = harmonics_;
      return found;
    }
    const int s = model_->coordinates(), n = grid_->points(), m = 2 * harmonics_ + 1;
    for (int c = 0; c < s; ++c)
      for (int j = 0; j < m; ++j) {
        double sum = 0.0;
        for (int i = 0; i < n; ++i)
          sum += basis_(i, j) * grid_->value(i, c);
        unknowns_(c * m + j, 0) = (j == 0 ? 1.0 : 2.0) * sum / n;
      }
  }
  for (;;) {
    const SolveReport report = newton(theta);
    found.iterations += report.iterations;
    found.status = report.status;
    found.harmonics = harmonics_;
    solved_ = report.status == SolveStatus::converged;
    if (!solved_) return found;
    found.left_out = left_out();
    found.sufficient = found.left_out <= options_.accuracy;
    if (found.sufficient || harmonics_ >= options_.most) return found;
    resize(std::min(options_.most, harmonics_ + std::max(2, harmonics_ / 2)));
  }
}

double HarmonicReduction::series(Eigen::Index column, double tau, int c) const {
  const int m = 2 * harmonics_ + 1;
  std::vector<double> row(static_cast<std::size_t>(m));
  fill_harmonic_row(tau, row);
  double sum = unknowns_(c * m, column);
  for (int k = 1; k < m; k += 2) {
    const double* terms = &row[static_cast<std::size_t>(k)];
    sum += unknowns_(c * m + k, column) * terms[0] + unknowns_(c * m + k + 1, column) * terms[1];
  }
  return sum;
}

double HarmonicReduction::value(double tau, int c) const {
  return series(0, tau, c);
}
double HarmonicReduction::sensitivity(double tau, int k, int c) const {
  return series(1 + k, tau, c);
}

double HarmonicReduction::amplitude(int harmonic, int c) const {
  const int m = 2 * harmonics_ + 1;
  if (harmonic == 0) return std::fabs(unknowns_(c * m, 0));
  return std::hypot(unknowns_(c * m + 2 * harmonic - 1, 0), unknowns_(c * m + 2 * harmonic, 0));
}

}  // namespace shaker::estimator
