// Inference from a fit: covariance (3.27), noise (3.28), condition. Contributions that widen the
// covariance are in estimation_covariance.cpp, undetermined parameters in estimation_singular.cpp,
// intervals (3.29) in estimation_description.cpp.
#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "estimator/fit/estimation_impl.hpp"
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

void Estimator::Impl::finish() {
  const bool solved = fit.status != FitStatus::no_solution;
  if (finish_from(solved ? residual_sum() : 0.0)) return;
  // Before a parameter is called undetermined, compute the sensitivities anew, free from what the
  // corrections at the velocity reversals kept of earlier steps.
  if (look_anew() && finish_from(residual_sum())) return;
  finish_by_svd(scratch_vector, free.size());
  finish_errors();
}

bool Estimator::Impl::look_anew() {
  constexpr int kRounds = 3;  // the corrections need the sensitivities of the round before
  for (PeriodicSystem& system : systems) {
    system.begin();
    for (int round = 0; round < kRounds; ++round) {
      if (system.solve(fit.theta).status != SolveStatus::converged) return false;
    }
  }
  accumulate(systems, false);
  return true;
}

bool Estimator::Impl::finish_from(double residuals) {
  const std::size_t q = free.size();
  fit.observations = observations;
  fit.degrees_of_freedom = observations - static_cast<long>(q);
  fit.lack_of_fit = kNaN;
  fit.lost.clear();
  std::fill(fit.standard_error.begin(), fit.standard_error.end(), 0.0);
  std::fill(fit.determined.begin(), fit.determined.end(), 1);
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
    fit.at_bound[k] = !p.fixed && (fit.theta[k] <= p.lower || fit.theta[k] >= p.upper);
  }
  if (fit.status == FitStatus::no_solution) return true;
  fit.sum_of_squares = residuals + total_scatter;
  finish_noise();
  if (q == 0) return true;

  scratch_vector.resize(q);
  for (std::size_t k = 0; k < q; ++k)
    scratch_vector[k] = std::sqrt(std::max(gram[k * q + k], 0.0));
  if (!finish_definite(scratch_vector, q)) return false;
  finish_errors();
  return true;
}

// Covariance and standard errors from the inverse Gram matrix in fit.covariance.
void Estimator::Impl::finish_errors() {
  const std::size_t q = free.size();
  const bool excitation_noise = std::any_of(runs.begin(), runs.end(), [](const RunState& run) {
    return run.data.excitation_error > 0.0;
  });
  inverse_gram = fit.covariance;
  if (covariances) {
    adjust_for_estimated_covariance();
  } else {
    const double variance =
        options.noise > 0.0 ? options.noise * options.noise : fit.noise * fit.noise;
    for (double& value : fit.covariance)
      value *= variance;
  }
  if (excitation_noise) add_excitation_error(inverse_gram);
  forget_undetermined();
  fit.quantile = cached_quantile(options.confidence, fit.interval_degrees);
  for (std::size_t k = 0; k < q; ++k) {
    fit.standard_error[free[k]] =
        fit.determined[free[k]] ? std::sqrt(fit.covariance[k * q + k]) : kNaN;
  }
}

// Runs last, because the contributions that widen the covariance need the complete inverse.
void Estimator::Impl::forget_undetermined() {
  const std::size_t q = free.size();
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t l = 0; l < q; ++l) {
      if (!fit.determined[free[k]] || !fit.determined[free[l]])
        fit.covariance[k * q + l] = inverse_gram[k * q + l] = kNaN;
    }
  }
}

// Sum of squared residuals. The last linearisation is one (tiny) step before the solution. Its rows
// are accurate there to second order, and so is this sum.
double Estimator::Impl::residual_sum() const {
  double left = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    for_each_datum(r, false, [&](const double*, double residual, double weight) {
      left += weight * residual * residual;
    });
  }
  return left;
}

// Noise: s of (3.28), or the known value.
void Estimator::Impl::finish_noise() {
  const auto degrees = static_cast<double>(fit.degrees_of_freedom);
  const bool known = covariances || options.noise > 0.0;
  fit.interval_degrees = known ? std::numeric_limits<double>::infinity() : degrees;
  fit.noise = degrees > 0.0 ? std::sqrt(fit.sum_of_squares / degrees) : kNaN;
  if (known && degrees > 0.0 && !priors) {
    const double scale = covariances ? 1.0 : options.noise * options.noise;
    fit.lack_of_fit = chi_squared_above(fit.sum_of_squares / scale, degrees);
  }
  if (!covariances) return;
  // Noise of one cycle's displacement at one time, in the frequency band of the coefficients.
  double variance = 0.0;
  for (const RunState& run : runs) {
    const std::size_t m = run.count();
    for (std::size_t j = 0; j < m; ++j)
      variance += (j == 0 ? 1.0 : 0.5) * run.data.harmonic_covariance[j * m + j] * run.data.cycles /
                  static_cast<double>(runs.size());
  }
  fit.noise = std::sqrt(variance);
}

// For a well conditioned problem: eigenvalues of the Gram matrix with unit diagonal.
bool Estimator::Impl::finish_definite(const std::vector<double>& scale, std::size_t q) {
  constexpr int kMost = 8;
  if (q > kMost) return false;
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  const auto size = static_cast<Eigen::Index>(q);
  Small unit(size, size);
  for (std::size_t k = 0; k < q; ++k) {
    if (!(scale[k] > 0.0)) return false;
    for (std::size_t l = 0; l <= k; ++l) {
      const double value = gram[k * q + l] / (scale[k] * scale[l]);
      unit(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) = value;
      unit(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(k)) = value;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Small> eigen(unit, Eigen::EigenvaluesOnly);
  const double smallest = eigen.eigenvalues()[0];
  const double largest = eigen.eigenvalues()[size - 1];
  if (!(smallest > 0.0) || largest / smallest > kGramCondition * kGramCondition) return false;
  fit.condition = std::sqrt(largest / smallest);
  const Small inverse = unit.llt().solve(Small::Identity(size, size));
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t l = 0; l < q; ++l)
      fit.covariance[k * q + l] =
          inverse(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) /
          (scale[k] * scale[l]);
  }
  return true;
}

}  // namespace shaker::estimator
