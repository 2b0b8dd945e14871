#include "estimator/fit/objectives/channels.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/fit/objectives/internal/channel_inference.hpp"
#include "estimator/math/box_minimum.hpp"
#include "estimator/math/damped_minimum.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNearlyUndamped = 1e-5, kMostDamped = 1e10;
constexpr double kFlat = 1e-10;      // relative change of the objective by rounding
constexpr double kSmallPart = 3e-5;  // of a standard error: a negligible step
constexpr int kMostStages = 200;

// Maximises the likelihood, all at once or stagewise.
class Search {
 public:
  Search(const Model& model, std::span<const Quantity> quantities, std::vector<ChannelRun> runs,
         const ChannelOptions& options)
      : options_(options),
        problem_(model, quantities, std::move(runs), options),
        likelihood_(problem_, options) {}

  ChannelFit run(const std::vector<double>& start) {
    ChannelFit out;
    Fit& fit = out.fit;
    fit.theta = start;
    fit.observations = std::lround(problem_.points() * static_cast<double>(problem_.channels()));
    fit.degrees_of_freedom = fit.observations - static_cast<long>(problem_.parameters());
    out.fit.status = FitStatus::no_solution;
    if (!problem_.look(start, now_)) {
      fit.trouble = problem_.trouble();
      finish_without_solution(problem_, fit);
      return out;
    }
    fit.status = FitStatus::not_converged;
    MatrixXd v =
        likelihood_.known() ? likelihood_.covariance(now_.moment) : problem_.spread_of_data();
    if (likelihood_.known()) {
      minimise(fit, &v);
    } else if (options_.stagewise) {
      stages(fit, v, out.stages);
    } else {
      minimise(fit, nullptr);
    }
    finish(problem_, likelihood_, now_, options_.confidence, out);
    return out;
  }

 private:
  // Returns the damped step to the minimum of the quadratic inside the box. Cutting the free step
  // at the bounds instead may end in a corner where two parameters have similar effects: each is
  // then held by a bound that only the other one's part of the step had crossed.
  VectorXd step(const std::vector<double>& theta, const MatrixXd& gram, const VectorXd& gradient,
                double lambda) const {
    const Index q = gradient.size();
    VectorXd lower(q), upper(q);
    for (Index k = 0; k < q; ++k) {
      const ModelParameter& p = problem_.parameter(k);
      const double value = theta[problem_.index(k)];
      // A step at most doubles a parameter; the linearisation is not accurate far away.
      const double most = std::max(std::fabs(value), 1e-3);
      lower[k] = std::max(p.lower - value, -most);
      upper[k] = std::min(p.upper - value, most);
    }
    return damped_box_step(gram, gradient, lower, upper, lambda);
  }

  double relative(const std::vector<double>& theta, const VectorXd& change) const {
    double worst = 0.0;
    for (Index k = 0; k < change.size(); ++k)
      worst = std::max(worst,
                       std::fabs(change[k]) / std::max(std::fabs(theta[problem_.index(k)]), 1e-12));
    return worst;
  }

  // A change of theta in standard errors, by the information matrix of the last step.
  double in_errors(const VectorXd& change) const {
    return std::sqrt(std::max(change.dot(information_ * change), 0.0));
  }

  // True if the remaining undamped step is a negligible part of the standard error, or its
  // predicted gain (its square) is below the rounding of the objective.
  bool at_bottom(const VectorXd& whole, double seen) const {
    return in_errors(whole) < std::max(kSmallPart, std::sqrt(seen));
  }

  // Levenberg-Marquardt from fit.theta. `fixed`: a constant V; null: V is eliminated.
  void minimise(Fit& fit, const MatrixXd* fixed) {
    Minimisation steps{*this, fit, fixed};
    steps.value = likelihood_.objective(now_, fit.theta, fixed);
    ChannelDamping damping{steps};
    const LoopEnd end = minimise_damped(steps, damping, options_.max_iterations);
    fit.status = end == LoopEnd::converged ? FitStatus::converged : FitStatus::not_converged;
    if (end != LoopEnd::converged)
      fit.trouble = fmt::format("no convergence in {} iterations", fit.iterations);
  }

  // What the loop asks: math/damped_minimum.hpp.
  struct Minimisation {
    Search& search;
    Fit& fit;
    const MatrixXd* fixed;
    double value = 0.0, after = 0.0;   // of the objective, before and after the step
    double seen = 0.0;                 // of it: what rounding changes
    double size = 0.0;                 // of the step, relative
    double promised = 0.0;             // decrease of the quadratic along the step
    bool full = false;                 // the step is not damped
    VectorXd change = {}, whole = {};  // the step, and the undamped one
    int at_rest = 0;

    bool compute_step(double lambda) {
      ++fit.iterations;
      ChannelLikelihood& likelihood = search.likelihood_;
      MatrixXd gram;
      VectorXd gradient;
      likelihood.normal_equations(
          search.now_, fit.theta,
          fixed != nullptr ? *fixed : likelihood.covariance(search.now_.moment), gram, gradient);
      search.information_ = gram;
      change = search.step(fit.theta, gram, gradient, lambda);
      full = lambda <= kNearlyUndamped;
      whole = full ? change : search.step(fit.theta, gram, gradient, 0.0);
      size = search.relative(fit.theta, change);
      seen = kFlat * std::max(std::fabs(value), search.problem_.points());
      promised = 2.0 * gradient.dot(change) - change.dot(gram * change);
      return true;
    }
    bool converged_before_step() const { return false; }
    bool step_is_successful() {
      after = value;
      return search.move(fit.theta, change, value + seen, fixed, after);
    }
    // Tests the undamped step, because a strongly damped step is short everywhere.
    bool converged_after_success() {
      const double tolerance = search.options_.tolerance;
      const bool still =
          search.relative(fit.theta, whole) <= 1e3 * tolerance || search.at_bottom(whole, seen);
      at_rest = still ? at_rest + 1 : 0;
      return (full && size <= tolerance) || at_rest > 8;
    }
    // Then only rounding made it worse.
    bool converged_after_failure() const { return search.at_bottom(whole, seen); }
  };

  // If the bounds exclude the true value, residuals are large and the likelihood has more curvature
  // than the information matrix. Full steps then oscillate about the optimum and achieve only a part
  // of the predicted decrease; the damping grows.
  struct ChannelDamping {
    Minimisation& steps;
    double lambda = 1e-4;

    bool raise_after_invalid_step() const { return false; }
    bool raise_after_failure() { return (lambda = std::max(lambda, 1e-8) * 10.0) <= kMostDamped; }
    void lower_after_success() {
      constexpr double kLight = 1e-3;
      const bool visible = steps.promised > 10.0 * steps.seen;
      const double kept = (steps.value - steps.after) / steps.promised;
      steps.value = steps.after;
      const bool less = visible ? kept > 0.75 : lambda < kLight;
      if (visible && kept < 0.25)
        lambda = std::max(lambda, 0.01) * 4.0;
      else if (less)
        lambda = std::max(lambda / 10.0, 1e-14);
    }
  };

  // Moves theta by `change` if the objective there, `after`, is at most `most`; now_ is then the
  // evaluation there. Returns false otherwise.
  bool move(std::vector<double>& theta, const VectorXd& change, double most, const MatrixXd* fixed,
            double& after) {
    std::vector<double> next = theta;
    for (Index k = 0; k < change.size(); ++k)
      next[problem_.index(k)] += change[k];
    ChannelLook there;
    if (!problem_.look(next, there)) return false;
    after = likelihood_.objective(there, next, fixed);
    if (!(after <= most)) return false;
    std::swap(now_, there);
    theta = std::move(next);
    return true;
  }

  // Alternates theta for a given V and V for a given theta until theta no longer moves.
  void stages(Fit& fit, MatrixXd v, int& count) {
    for (count = 0; count < kMostStages; ++count) {
      const std::vector<double> before = fit.theta;
      minimise(fit, &v);
      if (fit.status != FitStatus::converged) return;
      VectorXd moved(problem_.parameters());
      for (Index k = 0; k < moved.size(); ++k) {
        const std::size_t all = problem_.index(k);
        moved[k] = fit.theta[all] - before[all];
      }
      v = likelihood_.covariance(now_.moment);
      if (count > 0 && (relative(fit.theta, moved) <= 10.0 * options_.tolerance ||
                        in_errors(moved) < kSmallPart))
        return;
    }
    fit.status = FitStatus::not_converged;
    fit.trouble =
        fmt::format("the covariance of the noise does not converge in {} stages", kMostStages);
  }

  ChannelOptions options_;
  ChannelProblem problem_;
  ChannelLikelihood likelihood_;
  MatrixXd information_;  // of the last step
  ChannelLook now_;
};

}  // namespace

ChannelFit fit_channels(const Model& model, std::span<const Quantity> quantities,
                        std::vector<ChannelRun> runs, const std::vector<double>& start,
                        const ChannelOptions& options) {
  if (start.size() != static_cast<std::size_t>(model.parameter_count()))
    throw std::invalid_argument(fmt::format("the start has {} parameters, the model {}",
                                            start.size(), model.parameter_count()));
  return Search(model, quantities, std::move(runs), options).run(start);
}

}  // namespace shaker::estimator
