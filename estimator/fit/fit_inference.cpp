#include "estimator/fit/internal/fit_inference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "estimator/math/numbers.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

// The Gram matrix squares the condition number of the Jacobian. Above this limit for the Jacobian
// the singular values are used.
constexpr double kGramCondition = 1e4;

double cached_quantile(double confidence, double degrees) {
  if (!(degrees > 0.0)) return kNaN;
  static thread_local double cached_confidence = -1.0, cached_degrees = -1.0, cached = 0.0;
  if (confidence != cached_confidence || degrees != cached_degrees) {
    cached = student_t_quantile(0.5 + 0.5 * confidence, degrees);
    cached_confidence = confidence;
    cached_degrees = degrees;
  }
  return cached;
}

}  // namespace

FitInference::FitInference(const FitData& data, PeriodicSolutions& solutions,
                           GaussNewtonEquations& equations, Fit& fit)
    : data_(data), solutions_(solutions), equations_(equations), fit_(fit) {}

void FitInference::finish() {
  const bool solved = fit_.status != FitStatus::no_solution;
  if (finish_from(solved ? residual_sum() : 0.0)) return;
  // Before a parameter is called undetermined, compute the sensitivities anew, data_.free from what the
  // corrections at the velocity reversals kept of earlier steps.
  if (look_anew() && finish_from(residual_sum())) return;
  finish_by_svd();
  finish_errors();
}

bool FitInference::look_anew() {
  constexpr int kRounds = 3;  // the corrections need the sensitivities of the round before
  for (PeriodicSystem& system : solutions_.systems) {
    system.begin();
    for (int round = 0; round < kRounds; ++round) {
      if (system.solve(fit_.theta).status != SolveStatus::converged) return false;
    }
  }
  solutions_.sum_products(false, false, equations_.products);
  equations_.form(fit_.theta);
  return true;
}

bool FitInference::finish_from(double residuals) {
  const std::size_t q = data_.free.size();
  fit_.observations = data_.observations;
  fit_.degrees_of_freedom = data_.observations - static_cast<long>(q);
  fit_.lack_of_fit = kNaN;
  fit_.lost.clear();
  std::fill(fit_.standard_error.begin(), fit_.standard_error.end(), 0.0);
  std::fill(fit_.determined.begin(), fit_.determined.end(), 1);
  for (std::size_t k = 0; k < fit_.theta.size(); ++k) {
    const ModelParameter& p = data_.model.parameters()[k];
    fit_.at_bound[k] = !p.fixed && (fit_.theta[k] <= p.lower || fit_.theta[k] >= p.upper);
  }
  if (fit_.status == FitStatus::no_solution) return true;
  fit_.sum_of_squares = residuals + data_.total_scatter;
  finish_noise();
  if (q == 0) return true;

  scale_.resize(q);
  for (std::size_t k = 0; k < q; ++k)
    scale_[k] = std::sqrt(std::max(equations_.gram[k * q + k], 0.0));
  if (!finish_definite()) return false;
  finish_errors();
  return true;
}

// Covariance and standard errors from the inverse Gram matrix in fit_.covariance.
void FitInference::finish_errors() {
  const std::size_t q = data_.free.size();
  const bool excitation_noise =
      std::any_of(data_.runs.begin(), data_.runs.end(),
                  [](const RunState& run) { return run.data.excitation_error > 0.0; });
  inverse_gram_ = fit_.covariance;
  if (data_.covariances) {
    adjust_for_estimated_covariance();
  } else {
    const double variance = data_.options.noise > 0.0 ? data_.options.noise * data_.options.noise
                                                      : fit_.noise * fit_.noise;
    for (double& value : fit_.covariance)
      value *= variance;
  }
  if (excitation_noise) add_excitation_error();
  forget_undetermined();
  fit_.quantile = cached_quantile(data_.options.confidence, fit_.interval_degrees);
  for (std::size_t k = 0; k < q; ++k) {
    fit_.standard_error[data_.free[k]] =
        fit_.determined[data_.free[k]] ? std::sqrt(fit_.covariance[k * q + k]) : kNaN;
  }
}

// Runs last, because the contributions that widen the covariance need the complete inverse.
void FitInference::forget_undetermined() {
  const std::size_t q = data_.free.size();
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t l = 0; l < q; ++l) {
      if (!fit_.determined[data_.free[k]] || !fit_.determined[data_.free[l]])
        fit_.covariance[k * q + l] = inverse_gram_[k * q + l] = kNaN;
    }
  }
}

// Sum of squared residuals. The last linearisation is one (tiny) step before the solution. Its rows
// are accurate there to second order, and so is this sum.
double FitInference::residual_sum() const {
  double left = 0.0;
  for (std::size_t r = 0; r < data_.runs.size(); ++r) {
    data_.for_each_datum(r, solutions_.systems[r], false,
                         [&](const double*, double residual, double weight) {
                           left += weight * residual * residual;
                         });
  }
  return left;
}

// Noise: s of (3.28), or the known value.
void FitInference::finish_noise() {
  const auto degrees = static_cast<double>(fit_.degrees_of_freedom);
  const bool known = data_.covariances || data_.options.noise > 0.0;
  fit_.interval_degrees = known ? std::numeric_limits<double>::infinity() : degrees;
  fit_.noise = degrees > 0.0 ? std::sqrt(fit_.sum_of_squares / degrees) : kNaN;
  if (known && degrees > 0.0 && !data_.priors) {
    const double scale = data_.covariances ? 1.0 : data_.options.noise * data_.options.noise;
    fit_.lack_of_fit = chi_squared_above(fit_.sum_of_squares / scale, degrees);
  }
  if (!data_.covariances) return;
  // Noise of one cycle's displacement at one time, in the frequency band of the coefficients.
  double variance = 0.0;
  for (const RunState& run : data_.runs) {
    const std::size_t m = run.count();
    for (std::size_t j = 0; j < m; ++j)
      variance += (j == 0 ? 1.0 : 0.5) * run.data.harmonic_covariance[j * m + j] * run.data.cycles /
                  static_cast<double>(data_.runs.size());
  }
  fit_.noise = std::sqrt(variance);
}

// For a well conditioned problem: eigenvalues of the Gram matrix with unit diagonal.
bool FitInference::finish_definite() {
  constexpr int kMost = 8;
  const std::size_t q = data_.free.size();
  if (q > kMost) return false;
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  const auto size = static_cast<Eigen::Index>(q);
  Small unit(size, size);
  for (std::size_t k = 0; k < q; ++k) {
    if (!(scale_[k] > 0.0)) return false;
    for (std::size_t l = 0; l <= k; ++l) {
      const double value = equations_.gram[k * q + l] / (scale_[k] * scale_[l]);
      unit(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) = value;
      unit(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(k)) = value;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Small> eigen(unit, Eigen::EigenvaluesOnly);
  const double smallest = eigen.eigenvalues()[0];
  const double largest = eigen.eigenvalues()[size - 1];
  if (!(smallest > 0.0) || largest / smallest > kGramCondition * kGramCondition) return false;
  fit_.condition = std::sqrt(largest / smallest);
  const Small inverse = unit.llt().solve(Small::Identity(size, size));
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t l = 0; l < q; ++l)
      fit_.covariance[k * q + l] =
          inverse(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) /
          (scale_[k] * scale_[l]);
  }
  return true;
}

}  // namespace shaker::estimator
