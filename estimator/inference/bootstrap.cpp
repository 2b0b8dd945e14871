#include "estimator/inference/internal/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"
#include "estimator/math/parallel.hpp"

namespace shaker::estimator {
namespace {

constexpr long kMinReplications = 100;

struct Draw {
  bool converged = false;
  std::vector<double> theta, error;
};

// Simulates the data of a run around the prediction of the fit.
class Source {
 public:
  Source(const RunData& run, std::vector<double> predicted, double noise)
      : run_(run), predicted_(std::move(predicted)), noise_(noise) {
    if (run.harmonics.empty()) return;
    const auto m = static_cast<Eigen::Index>(run.harmonics.size());
    const Eigen::Map<const Eigen::MatrixXd> covariance(run.harmonic_covariance.data(), m, m);
    factor_ = Cholesky(covariance).root();
  }

  void draw(std::mt19937_64& random, RunData& out) const {
    std::normal_distribution<double> normal;
    if (run_.harmonics.empty()) {
      for (std::size_t j = 0; j < predicted_.size(); ++j) {
        const double weight =
            run_.cycles * run_.weight * (run_.sample_weight.empty() ? 1.0 : run_.sample_weight[j]);
        out.displacement[j] =
            predicted_[j] + (weight > 0.0 ? noise_ / std::sqrt(weight) * normal(random) : 0.0);
      }
      draw_scatter(random, out);
      return;
    }
    Eigen::VectorXd z(factor_.rows());
    for (double& each : z)
      each = normal(random);
    z = factor_ * z;
    for (std::size_t j = 0; j < predicted_.size(); ++j)
      out.harmonics[j] = predicted_[j] + z[static_cast<Eigen::Index>(j)];
    draw_covariance(random, out);
  }

 private:
  // Sum of squares of n (cycles - 1) degrees of freedom: chi-squared.
  void draw_scatter(std::mt19937_64& random, RunData& out) const {
    const double degrees = static_cast<double>(predicted_.size()) * (run_.cycles - 1.0);
    if (!(degrees > 0.0)) return;
    std::gamma_distribution<double> gamma(0.5 * degrees, 2.0);
    out.scatter = noise_ * noise_ / run_.weight * gamma(random);
  }
  // Covariance estimated from as many cycles: Wishart, by Bartlett's decomposition.
  void draw_covariance(std::mt19937_64& random, RunData& out) const {
    const double nu = run_.covariance_degrees;
    if (!(nu > 0.0)) return;
    std::normal_distribution<double> normal;
    const Eigen::Index m = factor_.rows();
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(m, m);
    for (Eigen::Index i = 0; i < m; ++i) {
      std::gamma_distribution<double> gamma(0.5 * (nu - static_cast<double>(i)), 2.0);
      a(i, i) = std::sqrt(gamma(random));
      for (Eigen::Index j = 0; j < i; ++j)
        a(i, j) = normal(random);
    }
    const Eigen::MatrixXd root = factor_ * a;
    const Eigen::MatrixXd covariance = root * root.transpose() / nu;
    std::copy_n(covariance.data(), covariance.size(), out.harmonic_covariance.begin());
  }

  const RunData& run_;
  std::vector<double> predicted_;
  double noise_;
  Eigen::MatrixXd factor_;
};

struct BootstrapWorker {
  std::vector<RunData> runs;
  Estimator estimator;
};

double quantile_of(std::vector<double> values, double probability) {
  std::sort(values.begin(), values.end());
  const double at = probability * static_cast<double>(values.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  const double part = at - std::floor(at);
  return i + 1 < values.size() ? (1.0 - part) * values[i] + part * values[i + 1] : values[i];
}

}  // namespace

Bootstrap bootstrap(const Model& model, const Estimator& estimator,
                    const std::vector<RunData>& runs, const BootstrapOptions& options) {
  if (options.replications < kMinReplications)
    throw std::invalid_argument("a bootstrap needs at least 100 replications");
  const Fit fit = estimator.last();
  const double noise = options.estimation.noise > 0.0 ? options.estimation.noise : fit.noise;
  std::vector<Source> sources;
  for (std::size_t r = 0; r < runs.size(); ++r)
    sources.emplace_back(runs[r], estimator.predicted(r), noise);
  std::vector<Draw> draws(static_cast<std::size_t>(options.replications));
  in_parallel(
      options.replications, options.threads,
      [&] {
        return BootstrapWorker{runs, Estimator(model, runs, options.estimation)};
      },
      [&](BootstrapWorker& worker, long i) {
        std::seed_seq sequence{static_cast<std::uint32_t>(options.seed),
                               static_cast<std::uint32_t>(options.seed >> 32),
                               static_cast<std::uint32_t>(i)};
        std::mt19937_64 random(sequence);
        for (std::size_t r = 0; r < sources.size(); ++r) {
          sources[r].draw(random, worker.runs[r]);
          worker.estimator.update_run(r, worker.runs[r]);
        }
        const Fit& again = worker.estimator.fit(fit.theta);
        Draw& draw = draws[static_cast<std::size_t>(i)];
        draw.converged = again.status == FitStatus::converged;
        draw.theta = again.theta;
        draw.error = again.standard_error;
      });

  Bootstrap result;
  result.replications = options.replications;
  for (const Draw& draw : draws)
    result.converged += draw.converged;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    if (model.parameters()[k].fixed || result.converged < 2) continue;
    std::vector<double> t;
    double sum = 0.0, squares = 0.0;
    for (const Draw& draw : draws) {
      if (!draw.converged) continue;
      const double off = draw.theta[k] - fit.theta[k];
      sum += off;
      squares += off * off;
      t.push_back(off / draw.error[k]);
    }
    const auto n = static_cast<double>(result.converged);
    const double tail = 0.5 * (1.0 - options.estimation.confidence);
    BootstrapInterval interval;
    interval.parameter = static_cast<int>(k);
    interval.bias = sum / n;
    interval.standard_error = std::sqrt((squares - sum * sum / n) / (n - 1.0));
    interval.lower = fit.theta[k] - quantile_of(t, 1.0 - tail) * fit.standard_error[k];
    interval.upper = fit.theta[k] - quantile_of(t, tail) * fit.standard_error[k];
    result.intervals.push_back(interval);
  }
  return result;
}

}  // namespace shaker::estimator
