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
#include "estimator/worth/description.hpp"
#include "estimator/worth/determination.hpp"

namespace shaker::estimator {
namespace {

// Below this share of the largest singular value of the scaled Jacobian a direction is lost in the
// rounding of a periodic solution (1e-11 of the stroke) and its sensitivities.
constexpr double kSmallestSingular = 1e-8;
// The Gram matrix squares the condition; beyond this it is left for the singular values.
constexpr double kGramCondition = 1e4;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

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

void multiply(const std::vector<double>& a, const std::vector<double>& b, std::vector<double>& out,
              std::size_t q) {
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j < q; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < q; ++k)
        sum += a[i * q + k] * b[k * q + j];
      out[i * q + j] = sum;
    }
  }
}

}  // namespace

void Estimator::Impl::finish() {
  const bool solved = fit.status != FitStatus::no_solution;
  if (finish_from(solved ? residual_sum() : 0.0)) return;
  // Data that do not determine a parameter are a grave thing to say: not before the sensitivities
  // have been made anew, without what the corrections at the kinks remember of the steps before.
  if (look_anew() && finish_from(residual_sum())) return;
  finish_by_svd(scratch_vector, free.size());
  finish_errors();
}

bool Estimator::Impl::look_anew() {
  constexpr int kRounds = 3;  // the corrections feed on the sensitivities of the round before
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

// Covariance and standard errors from the inverse that stands in fit.covariance.
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
  fit.quantile = cached_quantile(options.confidence, fit.interval_degrees);
  for (std::size_t k = 0; k < q; ++k) {
    fit.standard_error[free[k]] =
        fit.determined[free[k]] ? std::sqrt(fit.covariance[k * q + k]) : kNaN;
  }
}

// The last linearisation stands one (tiny) step before the solution; its rows are good to second
// order there, and so is the sum of squares of what is left.
double Estimator::Impl::residual_sum() const {
  double left = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    for_each_datum(r, false, [&](const double*, double residual, double weight) {
      left += weight * residual * residual;
    });
  }
  return left;
}

// s of (3.28), or what is known of it.
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
  // Of one cycle's displacement at one time, in the band of the coefficients.
  double variance = 0.0;
  for (const RunState& run : runs) {
    const std::size_t m = run.count();
    for (std::size_t j = 0; j < m; ++j)
      variance += (j == 0 ? 1.0 : 0.5) * run.data.harmonic_covariance[j * m + j] * run.data.cycles /
                  static_cast<double>(runs.size());
  }
  fit.noise = std::sqrt(variance);
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
      const auto add = [&](int point, double share) {
        const double* parts =
            &response[static_cast<std::size_t>(point * s + model.observed()) * kParts];
        for (std::size_t a = 0; a < q; ++a) {
          const double w = weight * row[1 + free[a]] * share;
          for (std::size_t m = 0; m < kParts; ++m)
            moved[a * kParts + m] += w * parts[m];
        }
      };
      const int n = systems[r].points();
      if (run.harmonic()) {
        for (int i = 0; i < n; ++i)
          add(i, run.projector[static_cast<std::size_t>(i) * run.count() + j]);
      } else {
        const Reading& reading = run.readings[j];
        for (int k = 0; k < reading.count; ++k)
          add((reading.base + k) % n, reading.weight[k]);
      }
      ++j;
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

// A covariance S from the scatter of few cycles (nu degrees of freedom) is itself uncertain, and
// plugging it in makes intervals too narrow. For one run and a linear model Rao (1965) gives the
// exact answer: with m data, q parameters and T^2 the weighted sum of squares of what is left,
//   (theta - truth) / sqrt(f c),  f = nu / (nu - m + q) (1 + T^2 / nu),  c of (J^T S^-1 J)^-1,
// is Student's t with nu - m + q degrees of freedom. With several runs each has its own f_r, its
// share q_r of the parameters being the trace of its information over all of it, and the degrees of
// freedom follow Satterthwaite.
void Estimator::Impl::adjust_for_estimated_covariance() {
  const std::size_t q = free.size();
  const std::vector<double> inverse = fit.covariance;
  std::vector<double> middle(q * q, 0.0), own(q * q), half(q * q);
  double shares = 0.0, shares_over_degrees = 0.0;
  double lack = 0.0, lack_degrees = 0.0;
  bool estimated = false;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    std::fill(own.begin(), own.end(), 0.0);
    double left = 0.0;
    for_each_datum(r, false, [&](const double* row, double residual, double weight) {
      left += weight * residual * residual;
      for (std::size_t k = 0; k < q; ++k) {
        for (std::size_t l = 0; l < q; ++l)
          own[k * q + l] += weight * row[1 + free[k]] * row[1 + free[l]];
      }
    });
    double share = 0.0;
    for (std::size_t i = 0; i < q * q; ++i)
      share += std::isfinite(inverse[i]) ? inverse[i] * own[i] : 0.0;
    const double surplus = static_cast<double>(runs[r].count()) - share;
    double factor = 1.0;
    const double nu = runs[r].data.covariance_degrees;
    if (nu > 0.0) {
      estimated = true;
      const double degrees = nu - surplus;
      factor = nu / degrees * (1.0 + left / nu);
      shares_over_degrees += share * factor * share * factor / degrees;
      // Expectation of T^2 with an estimated S, (nu / (nu - surplus - 1)) surplus: scaled back.
      lack += left * std::max(degrees - 1.0, 0.5) / nu;
    } else {
      lack += left;
    }
    lack_degrees += surplus;
    shares += share * factor;
    for (std::size_t i = 0; i < q * q; ++i)
      middle[i] += factor * own[i];
  }
  if (!estimated) return;
  if (shares_over_degrees > 0.0) fit.interval_degrees = shares * shares / shares_over_degrees;
  if (runs.size() == 1 && !priors) {  // Hotelling: exact
    const double nu = runs[0].data.covariance_degrees;
    const double degrees = nu - lack_degrees + 1.0;
    const double f = fit.sum_of_squares * degrees / (nu * lack_degrees);
    fit.lack_of_fit = fisher_f_above(f, lack_degrees, degrees);
  } else if (!priors) {
    fit.lack_of_fit = chi_squared_above(lack, lack_degrees);
  }
  // What a prior says is known exactly.
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(free[k])];
    if (p.prior_mean)
      middle[k * q + k] += 1.0 / (*p.prior_standard_deviation * *p.prior_standard_deviation);
  }
  multiply(inverse, middle, half, q);
  multiply(half, inverse, fit.covariance, q);
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

// Badly conditioned: singular values of the scaled Jacobian itself, and the directions it lacks.
void Estimator::Impl::finish_by_svd(const std::vector<double>& scale, std::size_t q) {
  const auto columns = static_cast<Eigen::Index>(q);
  Eigen::Index count = 0;
  for (const RunState& run : runs)
    count += static_cast<Eigen::Index>(run.count());
  const Eigen::Index rows = count + (priors ? columns : 0);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    for_each_datum(r, false, [&](const double* row, double, double weight) {
      for (std::size_t k = 0; k < q; ++k)
        jacobian(at, static_cast<Eigen::Index>(k)) =
            scale[k] > 0.0 ? std::sqrt(weight) * row[1 + free[k]] / scale[k] : 0.0;
      ++at;
    });
  }
  for (Eigen::Index k = 0; priors && k < columns; ++k) {
    const auto at_k = static_cast<std::size_t>(k);
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(free[at_k])];
    if (p.prior_mean && scale[at_k] > 0.0)
      jacobian(count + k, k) =
          std::sqrt(noise_variance()) / (*p.prior_standard_deviation * scale[at_k]);
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
    std::vector<double> lost(fit.theta.size(), 0.0);
    for (std::size_t k = 0; k < q; ++k) {
      const double part = direction[static_cast<Eigen::Index>(k)];
      if (std::fabs(part) <= 0.05) continue;
      fit.determined[free[k]] = 0;
      lost[free[k]] = scale[k] > 0.0 ? part / scale[k] : part;
    }
    fit.lost.push_back(std::move(lost));
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

Estimate describe(const Model& model, const Fit& fit) {
  Estimate e;
  e.model = model.name();
  e.noise_standard_deviation = fit.noise;
  e.sum_of_squares = fit.sum_of_squares;
  e.condition = fit.condition;
  e.observations = fit.observations;
  e.degrees_of_freedom = fit.degrees_of_freedom;
  e.iterations = fit.iterations;
  e.converged = fit.status == FitStatus::converged || fit.status == FitStatus::undetermined;
  e.covariance = fit.covariance;
  std::vector<std::string> on_bound;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
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
      if (entry.at_bound) on_bound.push_back(p.name);
    }
    e.parameters.push_back(std::move(entry));
  }
  if (!fit.trouble.empty()) e.warnings.push_back(fit.trouble);
  for (std::string& sentence : determination_warnings(model, fit))
    e.warnings.push_back(std::move(sentence));
  for (std::string& sentence :
       closing_warnings(on_bound, fit.observations, e.covariance_order.size()))
    e.warnings.push_back(std::move(sentence));
  e.usable = fit.status == FitStatus::converged && on_bound.empty() && fit.degrees_of_freedom > 0;
  return e;
}

Estimate Estimator::describe() const {
  Estimate e = estimator::describe(impl_->model, impl_->fit);
  e.runs = static_cast<int>(impl_->runs.size());
  for (const RunState& run : impl_->runs)
    e.cycles += static_cast<long>(run.data.cycles + 0.5);
  const std::vector<std::string> branch = impl_->branch_warnings();
  e.warnings.insert(e.warnings.end(), branch.begin(), branch.end());
  e.usable = e.usable && branch.empty();
  e.gap = impl_->model_gap();
  for (std::string& sentence : impl_->gap_warnings(e.gap))
    e.warnings.push_back(std::move(sentence));
  return e;
}

}  // namespace shaker::estimator
