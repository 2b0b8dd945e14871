#include "estimator/design/plan.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/inference/determination.hpp"
#include "estimator/inference/parallel.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator {
namespace {

constexpr int kGrid = 160;
// Weak prior for ranking sets that do not determine all parameters: a relative standard
// deviation of 1000 for every parameter.
constexpr double kWeakPrior = 1e-6;
// Least ratio of an eigenvalue of the unit-diagonal information to the largest one; below it the
// eigenvalue is rounding.
constexpr double kMinEigenvalueShare = 1e-12;
constexpr int kGreedyStarts = 6;
// A plan with an aim weighs the logarithm of the volume by this, so that the set leaves no other
// parameter open.
constexpr double kShareOfVolume = 0.05;

std::vector<double> point_of(const Model& model, const PlanOptions& options) {
  return options.theta.empty() ? model.start() : options.theta;
}

std::string refusal_of_setpoint(const PlanOptions& options, double frequency, double amplitude) {
  const PlanLimits& l = options.limits;
  if ((l.frequency_min_hz > 0.0 && frequency < l.frequency_min_hz) ||
      (l.frequency_max_hz > 0.0 && frequency > l.frequency_max_hz))
    return fmt::format("the rig allows {:g} to {:g} Hz", l.frequency_min_hz, l.frequency_max_hz);
  if (l.excitation_max > 0.0 && amplitude > l.excitation_max)
    return fmt::format("the rig allows an excitation of {:g}", l.excitation_max);
  // A set of most_runs runs must leave each of them a cycle.
  if (options.minutes > 0.0 &&
      60.0 * options.minutes / options.most_runs * frequency < options.settle_cycles + 1.0)
    return fmt::format("{:g} min do not suffice to settle and measure in each of {} runs",
                       options.minutes, options.most_runs);
  return {};
}

std::string refusal_of_motion(const PlanLimits& l, const PlanCandidate& c) {
  if (l.stroke_max > l.stroke_min && c.stroke_low < l.stroke_min)
    return fmt::format("the stroke would go down to {:.4g}; the rig allows {:g}", c.stroke_low,
                       l.stroke_min);
  if (l.stroke_max > l.stroke_min && c.stroke_high > l.stroke_max)
    return fmt::format("the stroke would go up to {:.4g}; the rig allows {:g}", c.stroke_high,
                       l.stroke_max);
  if (l.stroke_rate_max > 0.0 && c.rate > l.stroke_rate_max)
    return fmt::format("the stroke rate would be {:.3g}; the rig allows {:g}", c.rate,
                       l.stroke_rate_max);
  return {};
}

void examine(const Model& model, const PlanOptions& options, const std::vector<double>& theta,
             const std::vector<int>& free, PlanCandidate& c) {
  c.refused = refusal_of_setpoint(options, c.frequency_hz, c.amplitude);
  if (!c.refused.empty()) return;
  const int every = (kGrid + options.points - 1) / options.points;
  PeriodicSystem system(model, {Scheme::order6, every * options.points, true});
  system.set_excitation(c.frequency_hz, c.amplitude);
  const SolveReport report = system.solve_from_rest(theta);
  if (report.status != SolveStatus::converged) {
    c.refused = report.sentence();
    return;
  }
  c.stroke_low = c.stroke_high = system.value(0, model.observed());
  for (int i = 0; i < system.points(); ++i) {
    const double u = system.value(i, model.observed());
    c.stroke_low = std::min(c.stroke_low, u);
    c.stroke_high = std::max(c.stroke_high, u);
    c.rate = std::max(c.rate, std::fabs(system.velocity(i, model.observed())));
  }
  c.refused = refusal_of_motion(options.limits, c);
  if (!c.refused.empty()) return;
  const std::size_t q = free.size();
  c.information.assign(q * q, 0.0);
  const double weight = options.cycles / (options.noise * options.noise);
  for (int i = 0; i < options.points; ++i) {
    const auto row = system.observed_row(i * every);
    for (std::size_t k = 0; k < q; ++k) {
      for (std::size_t l = 0; l < q; ++l)
        c.information[k * q + l] += weight * row[static_cast<std::size_t>(1 + free[k])] *
                                    row[static_cast<std::size_t>(1 + free[l])];
    }
  }
}

// The cycles that a run of a set of `runs` runs measures.
double cycles_of(const PlanOptions& options, double frequency_hz, std::size_t runs) {
  if (!(options.minutes > 0.0)) return options.cycles;
  const double seconds = 60.0 * options.minutes / static_cast<double>(runs);
  return std::max(0.0, seconds * frequency_hz - options.settle_cycles);
}

// Evaluates sets by their information in relative parameters, including the model's priors.
class Judge {
 public:
  Judge(const Model& model, const PlanOptions& options,
        const std::vector<PlanCandidate>& candidates, const std::vector<int>& free,
        const std::vector<double>& theta)
      : options_(options), candidates_(candidates), q_(static_cast<Eigen::Index>(free.size())) {
    scale_.resize(q_);
    aim_ = Eigen::VectorXd::Zero(q_);
    prior_ = Eigen::MatrixXd::Zero(q_, q_);
    for (Eigen::Index k = 0; k < q_; ++k) {
      const auto at = static_cast<std::size_t>(free[static_cast<std::size_t>(k)]);
      scale_[k] = size_of(theta[at]);
      const auto& sigma = model.parameters()[at].prior_standard_deviation;
      if (sigma) prior_(k, k) = scale_[k] * scale_[k] / (*sigma * *sigma);
      if (!options.aim.empty()) aim_[k] = options.aim[at] * scale_[k];
    }
  }

  Eigen::MatrixXd information(const std::vector<std::size_t>& runs) const {
    Eigen::MatrixXd sum = prior_;
    for (const std::size_t r : runs) {
      const Eigen::Map<const Eigen::MatrixXd> own(candidates_[r].information.data(), q_, q_);
      const double share =
          cycles_of(options_, candidates_[r].frequency_hz, runs.size()) / options_.cycles;
      sum += share * (scale_.asDiagonal() * own * scale_.asDiagonal());
    }
    return sum;
  }

  // Logarithm of the relative errors' geometric mean; a smaller value is better.
  double d_criterion(const std::vector<std::size_t>& runs) const {
    const Eigen::MatrixXd m = with_weak_prior(runs);
    const Eigen::VectorXd root = Cholesky(m).root().diagonal();
    double sum = 0.0;
    for (Eigen::Index k = 0; k < q_; ++k)
      sum += std::log(root[k]);
    return -sum / static_cast<double>(q_);
  }
  double error_of(const std::vector<std::size_t>& runs, Eigen::Index k) const {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(q_, k);
    return Cholesky(with_weak_prior(runs)).solve(unit)[k];
  }

  // The standard error of what is aimed at.
  double aim_error(const std::vector<std::size_t>& runs) const {
    return std::sqrt(std::max(0.0, aim_.dot(Cholesky(with_weak_prior(runs)).solve(aim_))));
  }
  bool aims() const { return !options_.aim.empty(); }
  double criterion(const std::vector<std::size_t>& runs) const {
    const double volume = d_criterion(runs);
    return aims() ? std::log(aim_error(runs)) + kShareOfVolume * volume : volume;
  }

  const Eigen::VectorXd& scale() const { return scale_; }

 private:
  Eigen::MatrixXd with_weak_prior(const std::vector<std::size_t>& runs) const {
    return information(runs) + kWeakPrior * Eigen::MatrixXd::Identity(q_, q_);
  }
  const PlanOptions& options_;
  const std::vector<PlanCandidate>& candidates_;
  Eigen::Index q_;
  Eigen::VectorXd scale_, aim_;
  Eigen::MatrixXd prior_;
};

using Criterion = std::function<double(const std::vector<std::size_t>&)>;

// Replaces one run at a time by the best other one until no exchange helps. A run may occur
// twice, which means twice as many cycles of it.
void exchange(std::vector<std::size_t>& runs, const std::vector<std::size_t>& possible,
              const Criterion& criterion) {
  double best = criterion(runs);
  for (bool better = true; better;) {
    better = false;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::size_t before = runs[i];
      std::size_t chosen = before;
      for (const std::size_t other : possible) {
        runs[i] = other;
        const double value = criterion(runs);
        if (value < best - 1e-12 * std::fabs(best)) {
          best = value;
          chosen = other;
          better = true;
        }
      }
      runs[i] = chosen;
    }
  }
  std::sort(runs.begin(), runs.end());
}

// The best sets of `size` runs: those that greedy search from several single runs and exchange
// find, and their neighbours that differ by one run.
std::vector<std::vector<std::size_t>> best_sets(int size, int keep,
                                                const std::vector<std::size_t>& possible,
                                                const Criterion& criterion) {
  std::vector<std::size_t> singles = possible;
  std::sort(singles.begin(), singles.end(),
            [&](std::size_t a, std::size_t b) { return criterion({a}) < criterion({b}); });
  std::map<std::vector<std::size_t>, double> found;
  for (std::size_t s = 0; s < std::min<std::size_t>(singles.size(), kGreedyStarts); ++s) {
    std::vector<std::size_t> runs = {singles[s]};
    while (static_cast<int>(runs.size()) < size) {
      runs.push_back(possible.front());
      double best = std::numeric_limits<double>::infinity();
      std::size_t chosen = possible.front();
      for (const std::size_t other : possible) {
        runs.back() = other;
        const double value = criterion(runs);
        if (value < best) {
          best = value;
          chosen = other;
        }
      }
      runs.back() = chosen;
    }
    exchange(runs, possible, criterion);
    found[runs] = criterion(runs);
  }
  const auto optima = found;
  for (const auto& entry : optima) {
    for (std::size_t i = 0; i < entry.first.size(); ++i) {
      for (const std::size_t other : possible) {
        std::vector<std::size_t> runs = entry.first;
        runs[i] = other;
        std::sort(runs.begin(), runs.end());
        found[runs] = criterion(runs);
      }
    }
  }
  std::vector<std::pair<double, std::vector<std::size_t>>> ranked;
  for (const auto& entry : found)
    ranked.emplace_back(entry.second, entry.first);
  std::sort(ranked.begin(), ranked.end());
  std::vector<std::vector<std::size_t>> out;
  for (const auto& entry : ranked) {
    if (static_cast<int>(out.size()) >= keep) break;
    out.push_back(entry.second);
  }
  return out;
}

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

}  // namespace

PlanSet judge(const Model& model, const PlanOptions& options, const Plan& plan,
              std::vector<std::size_t> runs) {
  const std::vector<double> theta = point_of(model, options);
  const Judge judge(model, options, plan.candidates, plan.free, theta);
  const auto q = static_cast<Eigen::Index>(plan.free.size());
  PlanSet set;
  std::sort(runs.begin(), runs.end());
  set.runs = std::move(runs);
  for (const std::size_t r : set.runs) {
    const double frequency = plan.candidates[r].frequency_hz;
    set.cycles.push_back(cycles_of(options, frequency, set.runs.size()));
    set.seconds += set.cycles.back() / frequency;
  }
  if (judge.aims()) set.aim_error = judge.aim_error(set.runs);
  set.spread = std::exp(judge.d_criterion(set.runs));
  const Eigen::MatrixXd m = judge.information(set.runs);
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
    const double share = eigen.values[i] / eigen.values[q - 1];
    if (share > kMinEigenvalueShare && eigen.values[q - 1] > 0.0) {
      inverse += axis * axis.transpose() / eigen.values[i];
      continue;
    }
    set.determined = false;
    std::vector<double> lost(theta.size(), 0.0);
    for (Eigen::Index k = 0; k < q; ++k) {
      if (std::fabs(eigen.vectors(k, i)) <= 0.05) continue;
      const auto at = static_cast<std::size_t>(plan.free[static_cast<std::size_t>(k)]);
      lost[at] = axis[k] * judge.scale()[k];
      fit.determined[at] = 0;
    }
    fit.lost.push_back(std::move(lost));
  }
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(plan.free[static_cast<std::size_t>(k)]);
    set.error.push_back(fit.determined[at] ? judge.scale()[k] * std::sqrt(inverse(k, k)) : kNaN);
  }
  for (Eigen::Index k = 0; k < q; ++k) {
    for (Eigen::Index l = 0; l < q; ++l)
      fit.covariance.push_back(inverse(k, l) * judge.scale()[k] * judge.scale()[l]);
  }
  set.warnings = determination_warnings(model, fit);
  return set;
}

Result<Plan> make_plan(const Model& model, const PlanOptions& options) {
  Plan plan;
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (!model.parameters()[static_cast<std::size_t>(k)].fixed) plan.free.push_back(k);
  }
  if (const auto good = check(model, options, plan.free); !good) return good.error();
  const std::vector<double> theta = point_of(model, options);
  for (const double frequency : options.frequencies_hz) {
    for (const double amplitude : options.amplitudes) {
      PlanCandidate candidate;
      candidate.frequency_hz = frequency;
      candidate.amplitude = amplitude;
      plan.candidates.push_back(std::move(candidate));
    }
  }
  in_parallel(
      static_cast<long>(plan.candidates.size()), options.threads, [] { return 0; },
      [&](int, long i) {
        examine(model, options, theta, plan.free, plan.candidates[static_cast<std::size_t>(i)]);
      });
  std::vector<std::size_t> possible;
  for (std::size_t i = 0; i < plan.candidates.size(); ++i) {
    if (plan.candidates[i].refused.empty()) possible.push_back(i);
  }
  if (possible.empty()) return no_candidate(plan);
  const Judge criteria(model, options, plan.candidates, plan.free, theta);
  for (int size = 1; size <= options.most_runs; ++size) {
    const auto best = [&](const std::vector<std::size_t>& runs) {
      return criteria.criterion(runs);
    };
    for (auto& runs : best_sets(size, options.keep, possible, best))
      plan.sets.push_back(judge(model, options, plan, std::move(runs)));
  }
  if (criteria.aims()) {
    const auto d = [&](const std::vector<std::size_t>& runs) { return criteria.d_criterion(runs); };
    auto runs = best_sets(options.most_runs, 1, possible, d).front();
    plan.by_volume.push_back(judge(model, options, plan, std::move(runs)));
  }
  for (std::size_t k = 0; k < plan.free.size(); ++k) {
    const auto sharp = [&](const std::vector<std::size_t>& runs) {
      return criteria.error_of(runs, static_cast<Eigen::Index>(k));
    };
    plan.sharpest.push_back(
        judge(model, options, plan, best_sets(options.most_runs, 1, possible, sharp).front()));
  }
  return plan;
}

}  // namespace shaker::estimator
