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
  for (const RunState& run : runs) {
    const double n = static_cast<double>(run.data.displacement.size());
    count += static_cast<long>(n * run.data.cycles + 0.5);
    extra += run.data.weight * run.data.scatter;
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
  const bool excitation_noise = std::any_of(runs.begin(), runs.end(), [](const RunState& run) {
    return run.data.excitation_error > 0.0;
  });
  std::vector<double> inverse;
  if (excitation_noise) inverse = fit.covariance;
  const double variance = fit.noise * fit.noise;
  for (double& value : fit.covariance)
    value *= variance;
  if (excitation_noise) add_excitation_error(inverse);
  for (std::size_t k = 0; k < q; ++k) {
    fit.standard_error[free[k]] =
        fit.determined[free[k]] ? std::sqrt(fit.covariance[k * q + k]) : kNaN;
  }
}

// The excitation was measured too, with a sensor that has noise: whoever fits the response to a
// slightly wrong excitation gets slightly wrong parameters, the same way in all points of the
// period. With S the response to a harmonic of the excitation and e its standard error, theta moves
// by H^-1 J^T W S e; independent parts add up. Without this, intervals are too narrow by the ratio
// of that to the displacement's own noise (1.6 for an accelerometer of 5e-3 m/s^2 beside 2e-5 m).
void Estimator::Impl::add_excitation_error(const std::vector<double>& inverse) {
  constexpr int kHarmonics = 3;  // the response to higher ones is small
  constexpr std::size_t kParts = 2 * kHarmonics;
  const std::size_t q = free.size();
  std::vector<double> response;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunState& run = runs[r];
    const double error = run.data.excitation_error;
    if (!(error > 0.0) || !systems[r].excitation_response(kHarmonics, response)) continue;
    std::vector<double> moved(q * kParts, 0.0);
    std::size_t j = 0;
    const int s = model.coordinates();
    for_each_datum(r, false, [&](const double* row, double, double weight) {
      const Reading& reading = run.readings[j++];
      for (int k = 0; k < reading.count; ++k) {
        const int point = (reading.base + k) % systems[r].points();
        const double* parts =
            &response[static_cast<std::size_t>(point * s + model.observed()) * kParts];
        for (std::size_t a = 0; a < q; ++a) {
          const double w = weight * row[1 + free[a]] * reading.weight[k];
          for (std::size_t m = 0; m < kParts; ++m)
            moved[a * kParts + m] += w * parts[m];
        }
      }
    });
    for (std::size_t m = 0; m < kParts; ++m) {
      std::vector<double> shift(q, 0.0);
      for (std::size_t a = 0; a < q; ++a) {
        for (std::size_t b = 0; b < q; ++b)
          shift[a] += inverse[a * q + b] * moved[b * kParts + m];
      }
      for (std::size_t a = 0; a < q; ++a) {
        for (std::size_t b = 0; b < q; ++b)
          fit.covariance[a * q + b] += error * error * shift[a] * shift[b];
      }
    }
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
