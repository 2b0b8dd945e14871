#include "estimator/worth/posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/worth/parallel.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNowhere = -std::numeric_limits<double>::infinity();
constexpr double kTails = 5.0;        // degrees of freedom of the proposals
constexpr double kWide = 4.0;         // covariance of the component that no round forgets
constexpr double kWideShare = 0.1;    // of the draws
constexpr std::size_t kCentres = 60;  // of the mixture that follows the draws before

// A mixture of multivariate t of one shape around its centres, and a wide one around the mode.
class Proposal {
 public:
  Proposal(const VectorXd& mode, const MatrixXd& covariance)
      : mode_(mode), wide_(Eigen::LLT<MatrixXd>(kWide * covariance).matrixL()) {
    centres_ = {mode};
    narrow_ = Eigen::LLT<MatrixXd>(1.2 * covariance).matrixL();
  }

  void adapt(std::vector<VectorXd> centres, const MatrixXd& covariance) {
    const auto d = static_cast<double>(mode_.size());
    // Silverman's width for so many centres.
    const double width =
        std::pow(4.0 / (static_cast<double>(centres.size()) * (d + 2.0)), 1.0 / (d + 4.0));
    const Eigen::LLT<MatrixXd> factor(width * width * covariance);
    if (factor.info() != Eigen::Success) return;
    narrow_ = factor.matrixL();
    centres_ = std::move(centres);
  }

  VectorXd draw(std::mt19937_64& random) const {
    std::normal_distribution<double> normal;
    std::gamma_distribution<double> gamma(0.5 * kTails, 2.0);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    VectorXd z(mode_.size());
    for (double& value : z)
      value = normal(random);
    z *= std::sqrt(kTails / gamma(random));
    if (uniform(random) < kWideShare) return mode_ + wide_ * z;
    const auto which =
        static_cast<std::size_t>(uniform(random) * static_cast<double>(centres_.size()));
    return centres_[std::min(which, centres_.size() - 1)] + narrow_ * z;
  }

  // ln of the density, but for a constant that is the same for all rounds.
  double log_density(const VectorXd& at) const {
    double sum = kWideShare * kernel(at, mode_, wide_);
    for (const VectorXd& centre : centres_)
      sum +=
          (1.0 - kWideShare) / static_cast<double>(centres_.size()) * kernel(at, centre, narrow_);
    return std::log(std::max(sum, 1e-300));
  }

 private:
  static double kernel(const VectorXd& at, const VectorXd& centre, const MatrixXd& root) {
    const VectorXd z = root.triangularView<Eigen::Lower>().solve(at - centre);
    const auto d = static_cast<double>(at.size());
    return std::pow(1.0 + z.squaredNorm() / kTails, -0.5 * (kTails + d)) / root.diagonal().prod();
  }

  VectorXd mode_;
  MatrixXd wide_, narrow_;
  std::vector<VectorXd> centres_;
};

// Generalised Pareto distribution of excesses, ascending: shape by Zhang and Stephens (2009), drawn
// a little towards 1/2 as in Vehtari et al.; scale in `sigma`.
double pareto_shape(const std::vector<double>& x, double& sigma) {
  const auto n = static_cast<double>(x.size());
  const int grid = 30 + static_cast<int>(std::sqrt(n));
  const double quarter = x[static_cast<std::size_t>(n / 4.0 + 0.5) - 1];
  std::vector<double> theta, likelihood;
  const auto shape_at = [&](double t) {
    double sum = 0.0;
    for (const double value : x)
      sum += std::log1p(-t * value);
    return sum / n;
  };
  for (int j = 1; j <= grid; ++j) {
    const double t = 1.0 / x.back() + (1.0 - std::sqrt(grid / (j - 0.5))) / (3.0 * quarter);
    const double k = shape_at(t);
    theta.push_back(t);
    likelihood.push_back(n * (std::log(-t / k) - k - 1.0));
  }
  double total = 0.0, mean = 0.0;
  for (std::size_t j = 0; j < theta.size(); ++j) {
    double share = 0.0;
    for (const double other : likelihood)
      share += std::exp(other - likelihood[j]);
    mean += theta[j] / share;
    total += 1.0 / share;
  }
  mean /= total;
  const double k = shape_at(mean);
  sigma = -k / mean;
  return (k * n + 0.5 * 10.0) / (n + 10.0);
}

// Replaces the largest weights by the quantiles of the Pareto tail that they follow; its shape.
double smooth(std::vector<double>& weight) {
  const auto count = static_cast<double>(weight.size());
  const auto tail = static_cast<std::size_t>(std::min(0.2 * count, 3.0 * std::sqrt(count)));
  if (tail < 10) return std::numeric_limits<double>::infinity();
  std::vector<std::size_t> order(weight.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return weight[a] != weight[b] ? weight[a] < weight[b] : a < b;
  });
  const std::size_t first = order.size() - tail;
  const double cut = weight[order[first - 1]], largest = weight[order.back()];
  // Equal weights: the proposal is the posterior.
  if (!(largest > cut * (1.0 + 1e-9))) return kNowhere;
  std::vector<double> excess;
  for (std::size_t i = first; i < order.size(); ++i)
    excess.push_back(std::max(weight[order[i]] - cut, 1e-300));
  double sigma = 1.0;
  const double k = pareto_shape(excess, sigma);
  if (!std::isfinite(k) || !(sigma > 0.0)) return std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < tail; ++i) {
    const double p = (static_cast<double>(i) + 0.5) / static_cast<double>(tail);
    const double quantile = std::fabs(k) > 1e-12 ? sigma * std::expm1(-k * std::log1p(-p)) / k
                                                 : -sigma * std::log1p(-p);
    weight[order[first + i]] = std::min(cut + quantile, largest);
  }
  return k;
}

double weighted_quantile(const std::vector<double>& value, const std::vector<double>& weight,
                         const std::vector<std::size_t>& order, double probability) {
  double below = 0.0, previous = value[order.front()];
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double w = weight[order[i]];
    const double middle = below + 0.5 * w;
    if (middle >= probability) {
      const double before = i > 0 ? below - 0.5 * weight[order[i - 1]] : 0.0;
      const double share = middle > before ? (probability - before) / (middle - before) : 1.0;
      return previous + std::clamp(share, 0.0, 1.0) * (value[order[i]] - previous);
    }
    below += w;
    previous = value[order[i]];
  }
  return previous;
}

struct Round {
  std::vector<VectorXd> theta;
  std::vector<double> weight;  // sum 1
  VectorXd mean;
  MatrixXd covariance;
  double pareto_k = 0.0, effective = 0.0;
  long inadmissible = 0;
};

Round play(const std::function<LogDensity()>& make, const Proposal& proposal, int number,
           const PosteriorOptions& options) {
  Round round;
  const auto count = static_cast<std::size_t>(options.samples);
  round.theta.resize(count);
  round.weight.assign(count, kNowhere);
  in_parallel(options.samples, options.threads, make, [&](LogDensity& density, long i) {
    std::seed_seq sequence{static_cast<std::uint32_t>(options.seed),
                           static_cast<std::uint32_t>(options.seed >> 32),
                           static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(i)};
    std::mt19937_64 random(sequence);
    const auto at = static_cast<std::size_t>(i);
    round.theta[at] = proposal.draw(random);
    const VectorXd& theta = round.theta[at];
    const double log = density({theta.data(), static_cast<std::size_t>(theta.size())});
    if (log > kNowhere) round.weight[at] = log - proposal.log_density(theta);
  });
  const double most = *std::max_element(round.weight.begin(), round.weight.end());
  for (double& w : round.weight) {
    round.inadmissible += !(w > kNowhere);
    w = w > kNowhere ? std::exp(w - most) : 0.0;
  }
  if (!(most > kNowhere)) return round;
  round.pareto_k = smooth(round.weight);
  const double sum = std::accumulate(round.weight.begin(), round.weight.end(), 0.0);
  double squares = 0.0;
  round.mean = VectorXd::Zero(round.theta.front().size());
  for (std::size_t i = 0; i < count; ++i) {
    round.weight[i] /= sum;
    squares += round.weight[i] * round.weight[i];
    round.mean += round.weight[i] * round.theta[i];
  }
  round.effective = 1.0 / squares;
  round.covariance = MatrixXd::Zero(round.mean.size(), round.mean.size());
  for (std::size_t i = 0; i < count; ++i) {
    const VectorXd off = round.theta[i] - round.mean;
    round.covariance += round.weight[i] * off * off.transpose();
  }
  return round;
}

// Every (1 / kCentres)-th of the probability gives one of its draws.
std::vector<VectorXd> centres_of(const Round& round) {
  std::vector<VectorXd> centres;
  double sum = 0.0;
  for (std::size_t i = 0; i < round.theta.size(); ++i) {
    sum += round.weight[i];
    while (centres.size() < kCentres &&
           sum > (static_cast<double>(centres.size()) + 0.5) / static_cast<double>(kCentres))
      centres.push_back(round.theta[i]);
  }
  return centres;
}

PosteriorMarginal marginal(const Round& round, Index k, double mode, double confidence) {
  std::vector<double> value;
  for (const VectorXd& theta : round.theta)
    value.push_back(theta[k]);
  std::vector<std::size_t> order(value.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return value[a] != value[b] ? value[a] < value[b] : a < b;
  });
  PosteriorMarginal out;
  out.mean = round.mean[k];
  out.mode = mode;
  out.standard_deviation = std::sqrt(round.covariance(k, k));
  double error = 0.0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const double part = round.weight[i] * (value[i] - out.mean);
    error += part * part;
  }
  out.effective_samples = error > 0.0 ? round.covariance(k, k) / error : 0.0;
  const double tail = 0.5 * (1.0 - confidence);
  out.median = weighted_quantile(value, round.weight, order, 0.5);
  out.lower = weighted_quantile(value, round.weight, order, tail);
  out.upper = weighted_quantile(value, round.weight, order, 1.0 - tail);
  return out;
}

// The likelihood of a model's runs, each solved from its solution at the mode, so that the answer
// depends on theta alone.
class Likelihood {
 public:
  Likelihood(const Model& model, const std::vector<RunData>& runs, const Fit& fit,
             const EstimationOptions& how)
      : model_(model), runs_(runs), fit_(fit), how_(how), theta_(fit.theta) {
    for (int k = 0; k < model.parameter_count(); ++k) {
      if (!model.parameters()[static_cast<std::size_t>(k)].fixed)
        free_.push_back(static_cast<std::size_t>(k));
    }
    systems_.reserve(runs.size());
    for (const RunData& run : runs)
      add(run);
  }

  double operator()(std::span<const double> free) {
    double prior = 0.0;
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const ModelParameter& p = model_.parameters()[free_[k]];
      if (!(free[k] >= p.lower && free[k] <= p.upper)) return kNowhere;
      theta_[free_[k]] = free[k];
      if (!p.prior_mean) continue;
      const double off = (free[k] - *p.prior_mean) / *p.prior_standard_deviation;
      prior -= 0.5 * off * off;
    }
    double sum = 0.0, log = prior;
    for (std::size_t r = 0; r < systems_.size(); ++r) {
      if (!solve(r)) return kNowhere;
      if (runs_[r].harmonics.empty()) {
        sum += sum_of_squares(r);
        continue;
      }
      const double t2 = coefficients_off(r), nu = runs_[r].covariance_degrees;
      // A covariance from few cycles has itself an error: Sellentin and Heavens (2016).
      log -= nu > 0.0 ? 0.5 * (nu + 1.0) * std::log1p(t2 / nu) : 0.5 * t2;
    }
    if (!runs_.front().harmonics.empty()) return log;
    if (how_.noise > 0.0) return log - 0.5 * sum / (how_.noise * how_.noise);
    return log - 0.5 * static_cast<double>(fit_.observations) * std::log(std::max(sum, 1e-300));
  }

 private:
  void add(const RunData& run) {
    if (run.periods > 1)
      throw std::invalid_argument(
          "the posterior of responses that repeat after several excitation periods cannot be "
          "sampled; ask for profile intervals");
    GridOptions grid = how_.grid;
    const auto count = static_cast<int>(run.displacement.size());
    if (count > 0 && run.tau.empty()) grid.points = count * ((grid.points + count - 1) / count);
    PeriodicSystem& system = systems_.emplace_back(model_, grid);
    if (run.excitation.empty())
      system.set_excitation(run.frequency_hz, run.amplitude);
    else
      system.set_excitation(run.frequency_hz, run.excitation, how_.excitation_harmonics);
    system.solve_from_rest(fit_.theta);
    at_mode_.emplace_back(system.state().begin(), system.state().end());
    const auto m = static_cast<Index>(run.harmonics.size());
    factors_.emplace_back();
    if (m > 0)
      factors_.back() =
          Eigen::LLT<MatrixXd>(Eigen::Map<const MatrixXd>(run.harmonic_covariance.data(), m, m))
              .matrixL();
  }

  bool solve(std::size_t r) {
    PeriodicSystem& system = systems_[r];
    system.begin();
    std::copy(at_mode_[r].begin(), at_mode_[r].end(), system.state().begin());
    if (system.solve(theta_).status == SolveStatus::converged) return true;
    return system.solve_from_rest(theta_).status == SolveStatus::converged;
  }

  double predicted(const RunData& run, const PeriodicSystem& system, std::size_t j) const {
    const int n = system.points();
    if (run.tau.empty())
      return system.observed(static_cast<int>(j) * (n / static_cast<int>(run.displacement.size())));
    const double where = (run.tau[j] - std::floor(run.tau[j])) * n;
    const int first = static_cast<int>(std::floor(where)) - 2;
    double sum = 0.0;
    for (int k = 0; k < 6; ++k) {
      double weight = 1.0;
      for (int l = 0; l < 6; ++l) {
        if (l != k) weight *= (where - (first + l)) / (k - l);
      }
      sum += weight * system.observed((first + k + n) % n);
    }
    return sum;
  }

  double sum_of_squares(std::size_t r) const {
    const RunData& run = runs_[r];
    double sum = 0.0;
    for (std::size_t j = 0; j < run.displacement.size(); ++j) {
      const double e = run.displacement[j] - predicted(run, systems_[r], j);
      sum += (run.sample_weight.empty() ? 1.0 : run.sample_weight[j]) * e * e;
    }
    return run.weight * (run.cycles * sum + run.scatter);
  }

  double coefficients_off(std::size_t r) const {
    const RunData& run = runs_[r];
    const PeriodicSystem& system = systems_[r];
    VectorXd off =
        Eigen::Map<const VectorXd>(run.harmonics.data(), static_cast<Index>(run.harmonics.size()));
    const int n = system.points();
    for (int i = 0; i < n; ++i) {
      const double y = system.observed(i) / n;
      off[0] -= y;
      for (Index h = 1; 2 * h < off.size(); ++h) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(h * i % n) / n;
        off[2 * h - 1] -= 2.0 * y * std::cos(angle);
        off[2 * h] -= 2.0 * y * std::sin(angle);
      }
    }
    return factors_[r].triangularView<Eigen::Lower>().solve(off).squaredNorm();
  }

  const Model& model_;
  const std::vector<RunData>& runs_;
  const Fit& fit_;
  const EstimationOptions& how_;
  std::vector<double> theta_;
  std::vector<std::size_t> free_;
  std::vector<PeriodicSystem> systems_;
  std::vector<AlignedVector> at_mode_;
  std::vector<MatrixXd> factors_;  // Cholesky's, of the coefficients' covariances; or empty
};

}  // namespace

Posterior sample_posterior(const std::function<LogDensity()>& make_density,
                           const std::vector<double>& mode, const std::vector<double>& covariance,
                           const PosteriorOptions& options) {
  const auto d = static_cast<Index>(mode.size());
  if (d == 0 || covariance.size() != mode.size() * mode.size() || options.samples < 100 ||
      options.rounds < 1)
    throw std::invalid_argument(
        "a posterior needs a mode, a square covariance, 100 samples or more, and a round");
  const Eigen::Map<const VectorXd> centre(mode.data(), d);
  const MatrixXd spread = Eigen::Map<const MatrixXd>(covariance.data(), d, d);
  if (!spread.allFinite() || Eigen::LLT<MatrixXd>(spread).info() != Eigen::Success)
    throw std::invalid_argument(
        "the covariance around the mode is not positive definite, so there is no place to sample "
        "from; the data do not determine all parameters");
  Proposal proposal(centre, spread);
  Round round;
  for (int number = 0; number < options.rounds; ++number) {
    round = play(make_density, proposal, number, options);
    if (!(round.effective > 1.0)) break;
    if (number + 1 < options.rounds) proposal.adapt(centres_of(round), round.covariance);
  }
  Posterior out;
  out.samples = options.samples;
  out.inadmissible = round.inadmissible;
  out.effective_samples = round.effective;
  out.pareto_k = round.pareto_k;
  if (!(round.effective > 1.0)) return out;
  out.converged =
      round.pareto_k <= options.largest_pareto_k && round.effective >= options.fewest_effective;
  out.covariance.assign(round.covariance.data(), round.covariance.data() + d * d);
  for (Index k = 0; k < d; ++k)
    out.parameters.push_back(
        marginal(round, k, mode[static_cast<std::size_t>(k)], options.confidence));
  return out;
}

Posterior posterior(const Model& model, const Estimator& estimator,
                    const std::vector<RunData>& runs, const EstimationOptions& how,
                    const PosteriorOptions& options) {
  const Fit fit = estimator.last();
  std::vector<double> mode;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    if (!model.parameters()[k].fixed) mode.push_back(fit.theta[k]);
  }
  return sample_posterior(
      [&]() -> LogDensity {
        // Copyable, as std::function wants it: the workspace is shared with nobody.
        auto likelihood = std::make_shared<Likelihood>(model, runs, fit, how);
        return [likelihood](std::span<const double> theta) { return (*likelihood)(theta); };
      },
      mode, fit.covariance, options);
}

void replace_by_posterior(Estimate& estimate, const Posterior& posterior) {
  std::size_t next = 0;
  for (ParameterEstimate& p : estimate.parameters) {
    if (p.fixed || next >= posterior.parameters.size()) continue;
    const PosteriorMarginal& marginal = posterior.parameters[next++];
    p.lower = marginal.lower;
    p.upper = marginal.upper;
  }
  if (posterior.converged) return;
  estimate.warnings.push_back(fmt::format(
      "the sampling of the posterior has not converged: its {} draws are worth {:.0f}, their tail "
      "has the shape {:.2f} (0.7 is the most); take profile intervals, or give a parameter that "
      "the "
      "data leave open a prior or a bound",
      posterior.samples, posterior.effective_samples, posterior.pareto_k));
}

}  // namespace shaker::estimator
