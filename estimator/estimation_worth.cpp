// What an estimate is worth: covariance (3.27), noise (3.28), intervals (3.29), condition, and
// which parameters the data do not determine.
#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/estimation_impl.hpp"
#include "estimator/statistics.hpp"

namespace shaker::estimator {
namespace {

// Below this share of the largest singular value of the scaled Jacobian a direction is lost in the
// rounding of a periodic solution (1e-11 of the stroke) and its sensitivities.
constexpr double kSmallestSingular = 1e-8;
// The Gram matrix squares the condition; beyond this it is left for the singular values.
constexpr double kGramCondition = 1e4;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

void Estimator::Impl::finish() {
  const std::size_t q = free.size();
  long count = 0;
  double extra = 0.0;
  double extra_freedom = 0.0;
  for (const RunState& run : runs) {
    const double n = static_cast<double>(run.data.displacement.size());
    count += static_cast<long>(n * run.data.cycles + 0.5);
    extra += run.data.weight * run.data.scatter;
    extra_freedom += n * (run.data.cycles - 1.0);
  }
  fit.observations = count;
  fit.degrees_of_freedom = count - static_cast<long>(q);
  std::fill(fit.standard_error.begin(), fit.standard_error.end(), 0.0);
  std::fill(fit.determined.begin(), fit.determined.end(), 1);
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
    fit.at_bound[k] = !p.fixed && (fit.theta[k] <= p.lower || fit.theta[k] >= p.upper);
  }
  if (fit.status == FitStatus::no_solution) return;

  // The last linearisation stands one (tiny) step before the solution; its rows are good to second
  // order there, and so is the sum of squares of what is left.
  double left = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunState& run = runs[r];
    for (std::size_t j = 0; j < run.readings.size(); ++j) {
      const Reading& reading = run.readings[j];
      double predicted = 0.0;
      for (int k = 0; k < reading.count; ++k)
        predicted += reading.weight[k] *
                     systems[r].value((reading.base + k) % systems[r].points(), model.observed());
      const double residual = run.data.displacement[j] - predicted;
      left += run.inverse_variance * residual * residual;
    }
  }
  fit.sum_of_squares = left + extra;
  fit.noise = fit.degrees_of_freedom > 0
                  ? std::sqrt(fit.sum_of_squares / static_cast<double>(fit.degrees_of_freedom))
                  : kNaN;
  if (q == 0) return;

  scratch_vector.resize(q);
  for (std::size_t k = 0; k < q; ++k)
    scratch_vector[k] = std::sqrt(std::max(gram[k * q + k], 0.0));
  if (!finish_definite(scratch_vector, q)) finish_by_svd(scratch_vector, q);

  if (fit.degrees_of_freedom > 0) {
    static thread_local double cached_for = -1.0;
    static thread_local double cached = 0.0;
    const double key = static_cast<double>(fit.degrees_of_freedom) + options.confidence;
    if (key != cached_for) {
      cached = student_t_quantile(0.5 + 0.5 * options.confidence,
                                  static_cast<double>(fit.degrees_of_freedom));
      cached_for = key;
    }
    fit.quantile = cached;
  } else {
    fit.quantile = kNaN;
  }
  const double variance = fit.noise * fit.noise;
  for (double& value : fit.covariance)
    value *= variance;
  for (std::size_t k = 0; k < q; ++k) {
    fit.standard_error[free[k]] =
        fit.determined[free[k]] ? std::sqrt(fit.covariance[k * q + k]) : kNaN;
  }
}

// Well conditioned: eigenvalues of the Gram matrix with unit diagonal.
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
  const Eigen::SelfAdjointEigenSolver<Small> eigen(unit);
  const double smallest = eigen.eigenvalues()[0];
  const double largest = eigen.eigenvalues()[size - 1];
  if (!(smallest > 0.0) || largest / smallest > kGramCondition * kGramCondition) return false;
  fit.condition = std::sqrt(largest / smallest);
  const Small inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                        eigen.eigenvectors().transpose();
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t l = 0; l < q; ++l)
      fit.covariance[k * q + l] =
          inverse(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) /
          (scale[k] * scale[l]);
  }
  return true;
}

// Badly conditioned: singular values of the scaled Jacobian itself, and the directions it lacks.
void Estimator::Impl::finish_by_svd(const std::vector<double>& scale, std::size_t q) {
  const auto columns = static_cast<Eigen::Index>(q);
  Eigen::Index count = 0;
  for (const RunState& run : runs)
    count += static_cast<Eigen::Index>(run.readings.size());
  Eigen::MatrixXd jacobian(count, columns);
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    for_each_datum(r, false, [&](const double* row, double, double weight) {
      for (std::size_t k = 0; k < q; ++k)
        jacobian(at, static_cast<Eigen::Index>(k)) =
            scale[k] > 0.0 ? std::sqrt(weight) * row[1 + free[k]] / scale[k] : 0.0;
      ++at;
    });
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(jacobian, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  const auto rank = std::min<Eigen::Index>(sigma.size(), columns);
  fit.condition = sigma[0] / sigma[rank - 1];
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(columns, columns);
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::VectorXd direction = svd.matrixV().col(i);
    if (sigma[i] > kSmallestSingular * sigma[0]) {
      inverse += direction * direction.transpose() / (sigma[i] * sigma[i]);
      continue;
    }
    for (std::size_t k = 0; k < q; ++k) {
      if (std::fabs(direction[static_cast<Eigen::Index>(k)]) > 0.05) fit.determined[free[k]] = 0;
    }
  }
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t l = 0; l < q; ++l) {
      const bool known =
          scale[k] > 0.0 && scale[l] > 0.0 && fit.determined[free[k]] && fit.determined[free[l]];
      fit.covariance[k * q + l] =
          known ? inverse(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) /
                      (scale[k] * scale[l])
                : kNaN;
    }
    if (!(scale[k] > 0.0)) fit.determined[free[k]] = 0;
  }
  if (std::find(fit.determined.begin(), fit.determined.end(), 0) != fit.determined.end())
    fit.status = FitStatus::undetermined;
}

Estimate Estimator::describe() const {
  const Impl& impl = *impl_;
  const Fit& fit = impl.fit;
  Estimate e;
  e.model = impl.model.name();
  e.noise_standard_deviation = fit.noise;
  e.sum_of_squares = fit.sum_of_squares;
  e.condition = fit.condition;
  e.observations = fit.observations;
  e.degrees_of_freedom = fit.degrees_of_freedom;
  e.runs = static_cast<int>(impl.runs.size());
  for (const RunState& run : impl.runs)
    e.cycles += static_cast<long>(run.data.cycles + 0.5);
  e.iterations = fit.iterations;
  e.converged = fit.status == FitStatus::converged || fit.status == FitStatus::undetermined;
  e.covariance = fit.covariance;
  std::vector<std::string> lost, weak, on_bound;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = impl.model.parameters()[k];
    ParameterEstimate entry{
        p.name, p.effect, p.unit,  fit.theta[k],         fit.standard_error[k],
        0.0,    0.0,      p.fixed, fit.at_bound[k] != 0, fit.determined[k] != 0};
    const double half = fit.quantile * fit.standard_error[k];
    entry.lower = fit.theta[k] - half;
    entry.upper = fit.theta[k] + half;
    if (p.fixed) {
      entry.lower = entry.upper = fit.theta[k];
    } else {
      e.covariance_order.push_back(p.name);
      if (!entry.determined)
        lost.push_back(p.name);
      else if (fit.standard_error[k] > 0.5 * std::fabs(fit.theta[k]))
        weak.push_back(
            fmt::format("{} ({:.3g} +- {:.2g})", p.name, fit.theta[k], fit.standard_error[k]));
      if (entry.at_bound) on_bound.push_back(p.name);
    }
    e.parameters.push_back(std::move(entry));
  }
  if (!fit.trouble.empty()) e.warnings.push_back(fit.trouble);
  if (!lost.empty())
    e.warnings.push_back(fmt::format(
        "these data do not determine {}: a combination of them can change without any effect on "
        "the displacement; add runs at other frequencies and amplitudes, or fix one of them",
        fmt::join(lost, ", ")));
  if (!weak.empty())
    e.warnings.push_back(fmt::format(
        "these data determine {} only weakly; the linearised intervals are rough there; add "
        "runs at a larger amplitude or another frequency",
        fmt::join(weak, ", ")));
  if (!on_bound.empty())
    e.warnings.push_back(fmt::format(
        "{} ended on a bound, so the standard errors do not hold; check the bound or the model",
        fmt::join(on_bound, ", ")));
  if (fit.degrees_of_freedom <= 0)
    e.warnings.push_back(
        fmt::format("{} observations for {} parameters leave no degree of freedom "
                    "for the noise; no intervals can be given",
                    fit.observations, impl.free.size()));
  e.usable = fit.status == FitStatus::converged && on_bound.empty() && fit.degrees_of_freedom > 0;
  return e;
}

}  // namespace shaker::estimator
