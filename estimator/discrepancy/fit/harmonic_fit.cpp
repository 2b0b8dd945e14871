#include "estimator/discrepancy/fit/harmonic_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/discrepancy/fit/corners.hpp"
#include "estimator/math/box_minimum.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNotWorthIt = 0.1;  // of chi-squared
constexpr double kExact = 1e-6;      // of chi-squared

struct Normal {
  MatrixXd gram;
  VectorXd gradient;
  double chi_squared = 0.0;
};

bool counts(const RunDatum& datum) {
  return datum.role == Role::fit;
}

Normal normal_equations(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  const auto q = static_cast<Index>(fit.free.size());
  Normal n{MatrixXd::Zero(q, q), VectorXd::Zero(q), 0.0};
  VectorXd with_clock = VectorXd::Zero(q);
  double misfit = 0.0, size = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!counts(data[r])) continue;
    const VectorXd e = whitened_residual(fit, data, r);
    const MatrixXd j = whitened_jacobian(fit, data, r, fit.free);
    n.gram += j.transpose() * j;
    n.gradient += j.transpose() * e;
    n.chi_squared += e.squaredNorm();
    if (data[r].clock.size() == 0) continue;
    const VectorXd k = whitened(data[r], data[r].clock);
    with_clock += j.transpose() * k;
    misfit += k.dot(e);
    size += k.squaredNorm();
  }
  // The time base is off by a normal variate: that is one more column with a prior, eliminated.
  n.gram -= with_clock * with_clock.transpose() / (1.0 + size);
  n.gradient -= with_clock * (misfit / (1.0 + size));
  n.chi_squared -= misfit * misfit / (1.0 + size);
  return n;
}

bool predict_all(HarmonicFit& fit, const std::vector<RunDatum>& data,
                 const std::vector<double>& theta, bool fitted_only, bool from_rest = true) {
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (fitted_only && !counts(data[r])) continue;
    if (!fit.predictions[r].at(theta, from_rest)) return false;
  }
  return true;
}

// Minimises the quadratic of (gram + lambda diag) step = gradient inside the box.
VectorXd box_step(const HarmonicFit& fit, const Normal& n, double lambda) {
  const auto q = static_cast<Index>(fit.free.size());
  const VectorXd scale = n.gram.diagonal().cwiseMax(1e-300).cwiseSqrt();
  MatrixXd a = scale.cwiseInverse().asDiagonal() * n.gram * scale.cwiseInverse().asDiagonal();
  a.diagonal().array() += lambda + 1e-14;
  VectorXd to_lower(q), to_upper(q);
  for (Index k = 0; k < q; ++k) {
    const auto parameter = static_cast<std::size_t>(fit.free[static_cast<std::size_t>(k)]);
    const ModelParameter& p = fit.model->parameters()[parameter];
    to_lower[k] = p.lower - fit.theta[parameter];
    to_upper[k] = p.upper - fit.theta[parameter];
  }
  const VectorXd step = box_minimum(a, n.gradient.cwiseQuotient(scale),
                                    scale.cwiseProduct(to_lower), scale.cwiseProduct(to_upper));
  return step.cwiseQuotient(scale).cwiseMax(to_lower).cwiseMin(to_upper);
}

const char* solution_of(const std::vector<RunDatum>& data) {
  return data.front().sampled ? "motion through the record" : "periodic solution";
}

MatrixXd nothing_known(const HarmonicFit& fit) {
  const auto q = static_cast<Index>(fit.free.size());
  return MatrixXd::Constant(q, q, std::numeric_limits<double>::quiet_NaN());
}

void finish(HarmonicFit& fit, const Normal& n) {
  fit.chi_squared = n.chi_squared;
  const auto q = static_cast<Index>(fit.free.size());
  fit.covariance = nothing_known(fit);
  if (q == 0) return;
  const VectorXd scale = n.gram.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const MatrixXd unit =
      scale.cwiseInverse().asDiagonal() * n.gram * scale.cwiseInverse().asDiagonal();
  const Spectrum eigen = spectrum_of(unit);
  const VectorXd values = eigen.values.cwiseMax(1e-16);
  fit.condition = std::sqrt(values[q - 1] / values[0]);
  const MatrixXd inverse =
      eigen.vectors * values.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  fit.covariance = scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
}

// Levenberg-Marquardt from the fit's theta, where all runs have been predicted.
void iterate(HarmonicFit& fit, const std::vector<RunDatum>& data, const FitOptions& options) {
  Normal now = normal_equations(fit, data);
  double lambda = 0.0;
  int refused = 0, small = 0;
  while (fit.iterations < options.max_iterations) {
    const VectorXd step = box_step(fit, now, lambda);
    const double gain = 2.0 * step.dot(now.gradient) - step.dot(now.gram * step);
    if (!std::isfinite(gain)) break;
    // Where the model is far off, no more can be asked than the prediction is exact to.
    const double trifle = std::max(kNotWorthIt, kExact * now.chi_squared);
    if (gain < std::max(options.tolerance, kExact * now.chi_squared) && refused == 0) {
      fit.converged = true;
      break;
    }
    std::vector<double> trial = fit.theta;
    for (std::size_t k = 0; k < fit.free.size(); ++k) {
      auto& value = trial[static_cast<std::size_t>(fit.free[k])];
      value += step[static_cast<Index>(k)];
    }
    ++fit.iterations;
    if (predict_all(fit, data, trial, true, options.from_rest)) {
      const Normal next = normal_equations(fit, data);
      if (next.chi_squared < now.chi_squared) {
        small = now.chi_squared - next.chi_squared < trifle ? small + 1 : 0;
        fit.theta = std::move(trial);
        now = next;
        lambda = lambda < 1e-6 ? 0.0 : 0.1 * lambda;
        refused = 0;
        if (small >= 3) {
          fit.converged = true;
          break;
        }
        continue;
      }
    }
    // A promised gain that rounding and the grid do not let come true is no gain.
    if (gain < trifle || ++refused > 12) {
      fit.converged = gain < trifle;
      break;
    }
    lambda = std::max(1e-3, 6.0 * lambda);
  }
  predict_all(fit, data, fit.theta, true);
  now = normal_equations(fit, data);
  finish(fit, now);
}

}  // namespace

bool HarmonicFit::at_bound(int parameter) const {
  const ModelParameter& p = model->parameters()[static_cast<std::size_t>(parameter)];
  const double value = theta[static_cast<std::size_t>(parameter)];
  return !p.fixed && (value <= p.lower || value >= p.upper);
}

double HarmonicFit::standard_error(int parameter) const {
  const auto found = std::find(free.begin(), free.end(), parameter);
  if (found == free.end()) return 0.0;
  const auto k = static_cast<Index>(found - free.begin());
  return std::sqrt(covariance(k, k));
}

VectorXd whitened_residual(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                           std::size_t run) {
  return whitened(data[run], data[run].response - fit.predictions[run].value());
}

MatrixXd whitened_jacobian(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                           std::size_t run, const std::vector<int>& columns) {
  const MatrixXd& all = fit.predictions[run].jacobian();
  MatrixXd some(all.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    some.col(static_cast<Index>(k)) = all.col(columns[k]);
  return whitened(data[run], some);
}

double clock_error(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  double misfit = 0.0, size = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!counts(data[r]) || data[r].clock.size() == 0) continue;
    const VectorXd k = whitened(data[r], data[r].clock);
    misfit += k.dot(whitened_residual(fit, data, r));
    size += k.squaredNorm();
  }
  return misfit / (1.0 + size);
}

HarmonicFit fit_harmonics(const config::ModelSpec& spec, const std::vector<RunDatum>& data,
                          const std::vector<double>& start, const HarmonicFit* near,
                          const FitOptions& options) {
  HarmonicFit fit;
  fit.spec = spec;
  fit.model = std::make_shared<const Model>(spec);
  fit.theta = start.empty() ? fit.model->start() : start;
  for (int k = 0; k < fit.model->parameter_count(); ++k) {
    if (!fit.model->parameters()[static_cast<std::size_t>(k)].fixed) fit.free.push_back(k);
  }
  for (std::size_t r = 0; r < data.size(); ++r) {
    fit.run_models.push_back(
        options.sharp && has_corners(spec)
            ? std::make_shared<const Model>(rounded_for(spec, data[r], options.points))
            : fit.model);
    fit.predictions.emplace_back(*fit.run_models[r], data[r], options.points);
    if (near != nullptr) fit.predictions[r].start_from(near->predictions[r]);
    if (counts(data[r])) fit.observations += static_cast<int>(data[r].response.size());
  }
  if (!predict_all(fit, data, fit.theta, true)) {
    fit.trouble = fmt::format(
        "{}: there is no {} at the start of the estimation; give starting values nearer to the "
        "damper's",
        spec.name, solution_of(data));
    fit.chi_squared = std::numeric_limits<double>::infinity();
    fit.covariance = nothing_known(fit);
    return fit;
  }
  iterate(fit, data, options);
  if (!predict_all(fit, data, fit.theta, false)) {
    fit.converged = false;
    fit.trouble = fmt::format("{}: a held-out run has no {}", spec.name, solution_of(data));
  } else if (!fit.converged) {
    fit.trouble = fmt::format("{}: the fit did not settle in {} steps", spec.name, fit.iterations);
  }
  for (Prediction& prediction : fit.predictions)
    prediction.rest();
  return fit;
}

}  // namespace shaker::estimator::discrepancy
