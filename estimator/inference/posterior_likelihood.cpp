#include "estimator/inference/internal/posterior_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "estimator/math/dense.hpp"
#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kStepsOnTheWay = 8;

}  // namespace

PosteriorLikelihood::PosteriorLikelihood(const Model& model, const Estimator& estimator,
                                         const std::vector<RunData>& runs,
                                         const EstimationOptions& how)
    : model_(model),
      runs_(runs),
      fit_(estimator.last()),
      how_(how),
      theta_(fit_.theta),
      on_the_way_(fit_.theta) {
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (!model.parameters()[static_cast<std::size_t>(k)].fixed)
      free_.push_back(static_cast<std::size_t>(k));
  }
  systems_.reserve(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r)
    add(runs[r], estimator.solutions()[r]);
}

double PosteriorLikelihood::prior(std::span<const double> free) {
  double log = 0.0;
  for (std::size_t k = 0; k < free_.size(); ++k) {
    const ModelParameter& p = model_.parameters()[free_[k]];
    if (!(free[k] >= p.lower && free[k] <= p.upper)) return kNowhere;
    theta_[free_[k]] = free[k];
    if (!p.prior_mean) continue;
    const double off = (free[k] - *p.prior_mean) / *p.prior_standard_deviation;
    log -= 0.5 * off * off;
  }
  return log;
}

double PosteriorLikelihood::operator()(std::span<const double> free) {
  double sum = 0.0, log = prior(free);
  if (!(log > kNowhere)) return kNowhere;
  for (std::size_t r = 0; r < systems_.size(); ++r) {
    if (!solve(r)) return kNowhere;
    if (runs_[r].harmonics.empty()) {
      sum += sum_of_squares(r);
      continue;
    }
    const double t2 = coefficients_off(r), nu = runs_[r].covariance_degrees;
    // A covariance from few cycles has an error itself: Sellentin and Heavens (2016).
    log -= nu > 0.0 ? 0.5 * (nu + 1.0) * std::log1p(t2 / nu) : 0.5 * t2;
  }
  if (!runs_.front().harmonics.empty()) return log;
  if (how_.noise > 0.0) return log - 0.5 * sum / (how_.noise * how_.noise);
  return log - 0.5 * static_cast<double>(fit_.observations) * std::log(std::max(sum, 1e-300));
}

void PosteriorLikelihood::add(const RunData& run, const PeriodicSystem& fitted) {
  if (run.periods > 1)
    throw std::invalid_argument(
        "the posterior of responses that repeat after several excitation periods cannot be "
        "sampled; ask for profile intervals");
  GridOptions grid = how_.grid;
  const auto count = static_cast<int>(run.displacement.size());
  if (count > 0 && run.tau.empty()) grid.points = count * ((grid.points + count - 1) / count);
  PeriodicSystem& system = systems_.emplace_back(run.model_or(model_), grid);
  if (run.excitation.empty())
    system.set_excitation(run.frequency_hz, run.amplitude);
  else
    system.set_excitation(run.frequency_hz, run.excitation, how_.excitation_harmonics);
  // The start of Newton's method selects the branch.
  system.begin();
  system.interpolate_from(fitted);
  if (system.solve(fit_.theta).status != SolveStatus::converged) system.solve_from_rest(fit_.theta);
  at_mode_.emplace_back(system.state().begin(), system.state().end());
  const auto m = static_cast<Index>(run.harmonics.size());
  factors_.emplace_back();
  if (m > 0)
    factors_.back() =
        Cholesky(Eigen::Map<const MatrixXd>(run.harmonic_covariance.data(), m, m)).root();
}

bool PosteriorLikelihood::solve(std::size_t r) {
  PeriodicSystem& system = systems_[r];
  system.begin();
  std::copy(at_mode_[r].begin(), at_mode_[r].end(), system.state().begin());
  if (system.solve(theta_).status == SolveStatus::converged) return true;
  return follow(r) || system.solve_from_rest(theta_).status == SolveStatus::converged;
}

// Continuation in smaller steps from the mode: a failure of Newton's method over a long step does
// not prove that the branch has ended.
bool PosteriorLikelihood::follow(std::size_t r) {
  PeriodicSystem& system = systems_[r];
  system.begin();
  std::copy(at_mode_[r].begin(), at_mode_[r].end(), system.state().begin());
  for (int step = 1; step <= kStepsOnTheWay; ++step) {
    for (std::size_t k = 0; k < theta_.size(); ++k)
      on_the_way_[k] = fit_.theta[k] + (theta_[k] - fit_.theta[k]) * step / kStepsOnTheWay;
    if (system.solve(on_the_way_).status != SolveStatus::converged) return false;
  }
  return true;
}

double PosteriorLikelihood::predicted(const RunData& run, const PeriodicSystem& system,
                                      std::size_t j) const {
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

double PosteriorLikelihood::sum_of_squares(std::size_t r) const {
  const RunData& run = runs_[r];
  double sum = 0.0;
  for (std::size_t j = 0; j < run.displacement.size(); ++j) {
    const double e = run.displacement[j] - predicted(run, systems_[r], j);
    sum += (run.sample_weight.empty() ? 1.0 : run.sample_weight[j]) * e * e;
  }
  return run.weight * (run.cycles * sum + run.scatter);
}

double PosteriorLikelihood::coefficients_off(std::size_t r) const {
  const RunData& run = runs_[r];
  const PeriodicSystem& system = systems_[r];
  VectorXd off =
      Eigen::Map<const VectorXd>(run.harmonics.data(), static_cast<Index>(run.harmonics.size()));
  const int n = system.points();
  for (int i = 0; i < n; ++i) {
    const double y = system.observed(i) / n;
    for (Index k = 0; k < off.size(); ++k)
      off[k] -= (k == 0 ? 1.0 : 2.0) * y * harmonic_term(static_cast<int>(k), i, n);
  }
  return lower_solve(factors_[r], off).squaredNorm();
}

}  // namespace shaker::estimator
