#include "estimator/design/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/design/internal/plan_candidates.hpp"
#include "estimator/design/internal/plan_criteria.hpp"
#include "estimator/design/internal/plan_search.hpp"
#include "estimator/fit/determination.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"
#include "estimator/math/parallel.hpp"

namespace shaker::estimator {
namespace {

// Least ratio of an eigenvalue of the unit-diagonal information to the largest one; below it the
// eigenvalue is rounding.
constexpr double kMinEigenvalueShare = 1e-12;
// Relative standard error of the mean of the runs' values. Above it only their weak prior counts.
constexpr double kBlind = 10.0;
// A run that is worth its settling.
constexpr double kFewestCycles = 0.9;
constexpr double kTooFewCycles = std::numeric_limits<double>::infinity();

Result<void> check(const Model& model, const PlanOptions& o, const std::vector<int>& free) {
  const auto bad = [](std::string why) { return Error{ErrorKind::invalid, std::move(why)}; };
  if (free.empty()) return bad("all parameters of the model are fixed; there is nothing to plan");
  if (o.frequencies_hz.empty() || o.amplitudes.empty())
    return bad("there is no frequency or no amplitude to choose from");
  for (const double f : o.frequencies_hz)
    if (!(f > 0.0) || !std::isfinite(f))
      return bad(fmt::format("the frequency {} Hz is not positive", f));
  for (const double a : o.amplitudes)
    if (!(a > 0.0) || !std::isfinite(a))
      return bad(fmt::format("the amplitude {} is not positive", a));
  if (!(o.noise > 0.0) || !std::isfinite(o.noise))
    return bad(fmt::format("the noise is {}; it must be above 0", o.noise));
  if (o.points < 8 || o.cycles < 1 || o.most_runs < 1)
    return bad("there must be at least 8 points a period, 1 cycle and 1 run");
  if (!o.aim.empty() && static_cast<int>(o.aim.size()) != model.parameter_count())
    return bad(fmt::format("{} derivatives for a model of {} parameters", o.aim.size(),
                           model.parameter_count()));
  if (!(o.minutes >= 0.0) || !std::isfinite(o.minutes) || !(o.settle_cycles >= 0.0))
    return bad("the rig time and the cycles to settle must not be below 0");
  if (!o.theta.empty() && static_cast<int>(o.theta.size()) != model.parameter_count())
    return bad(
        fmt::format("{} parameters for a model of {}", o.theta.size(), model.parameter_count()));
  return {};
}

Error no_candidate(const Plan& plan) {
  std::map<std::string, int> reasons;
  std::string commonest;
  for (const PlanCandidate& c : plan.candidates) {
    if (++reasons[c.refused] > reasons[commonest]) commonest = c.refused;
  }
  return {ErrorKind::invalid,
          fmt::format("none of the {} runs is possible on this rig, most often because {}; choose "
                      "other frequencies or smaller amplitudes",
                      plan.candidates.size(), commonest)};
}

// The runs ascending, each with its share; equal shares where none are given.
RunShares in_order(std::vector<std::size_t> runs, std::vector<double> share) {
  if (share.empty()) {
    std::sort(runs.begin(), runs.end());
    return equally(std::move(runs));
  }
  std::vector<std::pair<std::size_t, double>> pairs;
  for (std::size_t i = 0; i < runs.size(); ++i)
    pairs.emplace_back(runs[i], share[i]);
  std::sort(pairs.begin(), pairs.end());
  RunShares set;
  for (const auto& [run, part] : pairs) {
    set.runs.push_back(run);
    set.share.push_back(part);
  }
  return set;
}

void add_times(const PlanCriteria& criteria, const RunShares& parts, const Plan& plan,
               PlanSet& set) {
  for (std::size_t i = 0; i < set.runs.size(); ++i) {
    set.cycles.push_back(criteria.cycles(parts, i));
    set.seconds += set.cycles.back() / plan.candidates[set.runs[i]].frequency_hz;
  }
}

}  // namespace

PlanSet judge(const Model& model, const PlanOptions& options, const Plan& plan,
              std::vector<std::size_t> runs, std::vector<double> share) {
  const std::vector<double> theta = point_of(model, options);
  const PlanCriteria criteria(model, options, plan.candidates, plan.free);
  const auto q = static_cast<Eigen::Index>(plan.free.size());
  PlanSet set;
  const RunShares parts = in_order(std::move(runs), std::move(share));
  set.runs = parts.runs;
  if (options.minutes > 0.0) set.share = parts.share;
  add_times(criteria, parts, plan, set);
  if (criteria.aims()) {
    set.aim_error = criteria.aim_error(parts);
    set.aim_over_prior = criteria.aim_over_prior(parts);
  }
  set.spread = std::exp(criteria.volume(parts));
  const Eigen::MatrixXd m = criteria.information(parts);
  const Eigen::VectorXd root = m.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd unit =
      root.cwiseInverse().asDiagonal() * m * root.cwiseInverse().asDiagonal();
  const Spectrum eigen = spectrum_of(unit);
  Fit fit;  // as an estimate from this set would give it
  fit.theta = theta;
  fit.determined.assign(theta.size(), 1);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(q, q);
  for (Eigen::Index i = 0; i < q; ++i) {
    const Eigen::VectorXd axis = root.cwiseInverse().asDiagonal() * eigen.vectors.col(i);
    const double weight = eigen.values[i] / eigen.values[q - 1];
    if (weight > kMinEigenvalueShare && eigen.values[q - 1] > 0.0) {
      inverse += axis * axis.transpose() / eigen.values[i];
      continue;
    }
    set.determined = false;
    std::vector<double> lost(theta.size(), 0.0);
    for (Eigen::Index k = 0; k < q; ++k) {
      if (std::fabs(eigen.vectors(k, i)) <= 0.05) continue;
      const auto at = static_cast<std::size_t>(plan.free[static_cast<std::size_t>(k)]);
      lost[at] = axis[k] * criteria.scale()[k];
      fit.determined[at] = 0;
    }
    fit.lost.push_back(std::move(lost));
  }
  for (Eigen::Index k = 0; criteria.varies() && k < q; ++k) {
    if (inverse(k, k) < kBlind * kBlind) continue;
    const auto at = static_cast<std::size_t>(plan.free[static_cast<std::size_t>(k)]);
    set.determined = false;
    fit.determined[at] = 0;
    fit.lost.emplace_back(theta.size(), 0.0)[at] = criteria.scale()[k];
  }
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(plan.free[static_cast<std::size_t>(k)]);
    set.error.push_back(fit.determined[at] ? criteria.scale()[k] * std::sqrt(inverse(k, k)) : kNaN);
  }
  for (Eigen::Index k = 0; k < q; ++k) {
    for (Eigen::Index l = 0; l < q; ++l)
      fit.covariance.push_back(inverse(k, l) * criteria.scale()[k] * criteria.scale()[l]);
  }
  set.warnings = determination_warnings(model, fit);
  return set;
}

namespace {

std::vector<std::size_t> possible_in(const Plan& plan) {
  std::vector<std::size_t> possible;
  for (std::size_t i = 0; i < plan.candidates.size(); ++i) {
    if (plan.candidates[i].refused.empty()) possible.push_back(i);
  }
  return possible;
}

void examine_from(std::size_t first, const Model& model, const PlanOptions& options, Plan& plan) {
  in_parallel(
      static_cast<long>(plan.candidates.size() - first), options.threads, [] { return 0; },
      [&](int, long i) {
        examine(model, options, plan.free, plan.candidates[first + static_cast<std::size_t>(i)]);
      });
}

// The best sets of every size up to most_runs for the plan's own criterion. With an aim and a rig
// time, the time is shared as serves the aim best.
std::vector<PlanSet> ranked_sets(const Model& model, const PlanOptions& options, const Plan& plan) {
  const PlanCriteria criteria(model, options, plan.candidates, plan.free);
  const bool shared = criteria.aims() && options.minutes > 0.0;
  const Criterion worth = [&](const RunShares& set) {
    for (std::size_t i = 0; shared && i < set.runs.size(); ++i) {
      if (criteria.cycles(set, i) < kFewestCycles) return kTooFewCycles;
    }
    return criteria.criterion(set);
  };
  std::vector<PlanSet> sets;
  for (int size = 1; size <= options.most_runs; ++size) {
    std::vector<std::pair<double, RunShares>> found;
    for (auto& runs : best_sets(size, options.keep, possible_in(plan), worth)) {
      RunShares set = shared ? best_shares(std::move(runs), worth) : equally(std::move(runs));
      const double value = worth(set);
      found.emplace_back(value, std::move(set));
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& entry : found)
      sets.push_back(
          judge(model, options, plan, std::move(entry.second.runs), std::move(entry.second.share)));
  }
  return sets;
}

PlanSet best_by_volume(const Model& model, const PlanOptions& options, const Plan& plan) {
  const PlanCriteria criteria(model, options, plan.candidates, plan.free);
  const auto runs = best_sets(options.most_runs, 1, possible_in(plan),
                              [&](const RunShares& set) { return criteria.volume(set); });
  return judge(model, options, plan, runs.front());
}

// Further candidates about the best sets for the aim, and as many about the best for the volume.
void refine(const Model& model, const PlanOptions& options, Plan& plan) {
  for (int round = 1; round <= options.refinements; ++round) {
    std::vector<PlanSet> about = {best_by_volume(model, options, plan)};
    std::size_t size = 0;
    for (PlanSet& set : ranked_sets(model, options, plan)) {
      if (set.runs.size() == size) continue;  // only the best set of each size
      size = set.runs.size();
      about.push_back(std::move(set));
    }
    const std::size_t first = plan.candidates.size();
    for (PlanCandidate& c : candidates_about(about, plan, options, round))
      plan.candidates.push_back(std::move(c));
    examine_from(first, model, options, plan);
  }
}

}  // namespace

Result<Plan> make_plan(const Model& model, const PlanOptions& options) {
  Plan plan;
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (!model.parameters()[static_cast<std::size_t>(k)].fixed) plan.free.push_back(k);
  }
  if (const auto good = check(model, options, plan.free); !good) return good.error();
  plan.candidates = grid_of(options);
  examine_from(0, model, options, plan);
  if (possible_in(plan).empty()) return no_candidate(plan);
  const bool aims = !options.aim.empty();
  if (aims) refine(model, options, plan);
  plan.sets = ranked_sets(model, options, plan);
  if (aims) plan.by_volume.push_back(best_by_volume(model, options, plan));
  const PlanCriteria criteria(model, options, plan.candidates, plan.free);
  for (std::size_t k = 0; k < plan.free.size(); ++k) {
    const auto sharp = [&](const RunShares& set) {
      return criteria.error_of(set, static_cast<Eigen::Index>(k));
    };
    const auto runs = best_sets(options.most_runs, 1, possible_in(plan), sharp).front();
    plan.sharpest.push_back(judge(model, options, plan, runs));
  }
  return plan;
}

}  // namespace shaker::estimator
