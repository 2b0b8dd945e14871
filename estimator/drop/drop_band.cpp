// Uncertainty of a drop from the covariance of the parameters: delta method and sampling.
#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Dense>

#include "estimator/drop/drop.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

constexpr double kShareOfError = 0.02;  // step of a derivative, in standard errors

using Eigen::MatrixXd;

MatrixXd covariance_of(const DropUncertainty& u) {
  const auto q = static_cast<Eigen::Index>(u.parameters.size());
  MatrixXd v(q, q);
  for (Eigen::Index i = 0; i < q; ++i) {
    for (Eigen::Index k = 0; k < q; ++k)
      v(i, k) = u.covariance[static_cast<std::size_t>(i * q + k)];
  }
  return v;
}

// Derivatives of the figures over the uncertain parameters.
Result<MatrixXd> slopes(const DropTest& test, const std::vector<double>& theta,
                        const DropUncertainty& uncertainty, const MatrixXd& v) {
  MatrixXd out(static_cast<Eigen::Index>(kDropFigureCount), v.cols());
  for (Eigen::Index k = 0; k < v.cols(); ++k) {
    const auto at = static_cast<std::size_t>(uncertainty.parameters[static_cast<std::size_t>(k)]);
    const double step = std::max(kShareOfError * std::sqrt(std::max(v(k, k), 0.0)),
                                 1e-7 * std::fabs(theta[at]) + 1e-12);
    auto moved = theta;
    moved[at] = theta[at] + step;
    const auto up = test.run(moved, false);
    if (!up) return up.error();
    moved[at] = theta[at] - step;
    const auto down = test.run(moved, false);
    if (!down) return down.error();
    for (std::size_t f = 0; f < kDropFigureCount; ++f)
      out(static_cast<Eigen::Index>(f), k) = (up->figures[f] - down->figures[f]) / (2.0 * step);
  }
  return out;
}

void history_errors(DropRun& run, const DropUncertainty& uncertainty, const MatrixXd& v) {
  const std::size_t n = run.history.t.size();
  const std::size_t p = run.stroke_derivatives.size() / n;
  const auto error = [&](const std::vector<double>& derivatives, std::size_t i) {
    Eigen::VectorXd d(v.cols());
    for (Eigen::Index k = 0; k < v.cols(); ++k)
      d[k] = derivatives[i * p + static_cast<std::size_t>(
                                     uncertainty.parameters[static_cast<std::size_t>(k)])];
    return std::sqrt(std::max(0.0, d.dot(v * d)));
  };
  for (std::size_t i = 0; i < n; ++i) {
    run.history.stroke_error.push_back(error(run.stroke_derivatives, i));
    run.history.load_error.push_back(error(run.load_derivatives, i));
  }
}

double quantile_of(std::vector<double>& sorted, double probability) {
  const double at = probability * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

// Draws from Student's distribution: normal draws divided by sqrt(chi-square / degrees of freedom).
void sample(const DropTest& test, const std::vector<double>& theta,
            const DropUncertainty& uncertainty, const MatrixXd& v, DropPrediction& out) {
  const Spectrum eigen = spectrum_of(v);
  const MatrixXd root = eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  std::mt19937_64 random(uncertainty.seed);
  std::normal_distribution<double> normal;
  std::chi_squared_distribution<double> chi(std::max(1.0, uncertainty.degrees_of_freedom));
  std::vector<std::vector<double>> found(kDropFigureCount);
  for (int i = 0; i < uncertainty.samples; ++i) {
    Eigen::VectorXd z(v.cols());
    for (double& value : z)
      value = normal(random);
    const double spread = std::sqrt(std::max(1.0, uncertainty.degrees_of_freedom) / chi(random));
    const Eigen::VectorXd step = spread * (root * z);
    auto drawn = theta;
    bool inside = true;
    for (Eigen::Index k = 0; k < v.cols(); ++k) {
      const auto at = static_cast<std::size_t>(uncertainty.parameters[static_cast<std::size_t>(k)]);
      const ModelParameter& p = test.model().parameters()[at];
      drawn[at] += step[k];
      inside = inside && drawn[at] >= p.lower && drawn[at] <= p.upper;
    }
    const auto run = inside ? test.run(drawn, false) : Result<DropRun>(Error{});
    if (!run) {
      ++out.lost;
      out.outside += inside ? 0 : 1;
      continue;
    }
    ++out.samples;
    for (std::size_t f = 0; f < kDropFigureCount; ++f) {
      if (std::isfinite(run->figures[f])) found[f].push_back(run->figures[f]);
    }
  }
  const double tail = 0.5 * (1.0 - uncertainty.confidence);
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    if (found[f].empty()) continue;
    std::sort(found[f].begin(), found[f].end());
    out.bands[f].sampled_lower = quantile_of(found[f], tail);
    out.bands[f].sampled_upper = quantile_of(found[f], 1.0 - tail);
  }
  out.drawn = std::move(found);
}

}  // namespace

Result<DropPrediction> predict_drop(const DropTest& test, const std::vector<double>& theta,
                                    const DropUncertainty& uncertainty) {
  const bool banded = !uncertainty.covariance.empty();
  auto run = test.run(theta, banded);
  if (!run) return run.error();
  DropPrediction out;
  out.run = std::move(*run);
  for (const double value : out.run.figures)
    out.bands.push_back({value, 0.0, value, value, value, value});
  if (!banded) return out;
  const MatrixXd v = covariance_of(uncertainty);
  const auto slope = slopes(test, theta, uncertainty, v);
  if (!slope) return slope.error();
  const double quantile = student_t_quantile(0.5 + 0.5 * uncertainty.confidence,
                                             std::max(1.0, uncertainty.degrees_of_freedom));
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    const Eigen::RowVectorXd row = slope->row(static_cast<Eigen::Index>(f));
    DropBand& band = out.bands[f];
    band.error = std::sqrt(std::max(0.0, (row * v).dot(row)));
    band.lower = band.value - quantile * band.error;
    band.upper = band.value + quantile * band.error;
  }
  history_errors(out.run, uncertainty, v);
  sample(test, theta, uncertainty, v, out);
  return out;
}

}  // namespace shaker::estimator
