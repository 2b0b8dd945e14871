#include "estimator/discrepancy/assemble.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/discrepancy/harmonics.hpp"
#include "estimator/discrepancy/inverse_dynamics.hpp"
#include "estimator/discrepancy/nesting.hpp"
#include "estimator/discrepancy/split_run.hpp"
#include "estimator/discrepancy/transient_cosines.hpp"
#include "estimator/discrepancy/transient_run.hpp"
#include "estimator/effects/catalogue.hpp"
#include "estimator/statistics.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kInTheSet = 4.0;         // of log evidence behind the best: cannot be excluded
constexpr double kGainInTheSet = 8.0;     // of chi-squared behind, for those that were not refitted
constexpr double kFirstEffect = 0.75;     // of the gap's square, by the first effect
constexpr double kHalved = 0.5;           // of chi-squared, by one more effect
constexpr double kOfGap = 0.6;            // of the gap's square, by one more where that is weighed
constexpr double kIndependent = 4.0;      // numbers in a run's model error: its parts hang together
constexpr double kShareOfRecord = 0.125;  // of a record's
constexpr double kNearlyAsMuch = 2.0 / 3.0;  // of the gap's square that the best closes
constexpr double kMostUnexplained = 0.9;     // probability of a name while something is left
constexpr int kCurvePoints = 128;
constexpr Eigen::Index kStretchPoints = 400;

std::vector<double> list(const VectorXd& v) {
  return {v.data(), v.data() + v.size()};
}

std::vector<ParameterEstimate> describe(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  double freedom = 0.0, count = 0.0;
  for (const RunDatum& datum : data) {
    freedom += datum.freedom.sum();
    count += static_cast<double>(datum.freedom.size());
  }
  const double quantile = student_t_quantile(0.975, std::max(2.0, freedom / count));
  std::vector<ParameterEstimate> all;
  const auto& parameters = fit.model->parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    ParameterEstimate p;
    p.name = parameters[k].name;
    p.effect = parameters[k].effect;
    p.unit = parameters[k].unit;
    p.value = fit.theta[k];
    p.fixed = parameters[k].fixed;
    p.at_bound = fit.at_bound(static_cast<int>(k));
    p.standard_error = fit.standard_error(static_cast<int>(k));
    p.determined = p.fixed || p.standard_error < 1e3 * (std::fabs(p.value) + 1e-9);
    p.lower = p.value - quantile * p.standard_error;
    p.upper = p.value + quantile * p.standard_error;
    all.push_back(std::move(p));
  }
  return all;
}

// Starting values of a model file at a fit's estimates.
config::ModelSpec at_estimates(const HarmonicFit& fit) {
  config::ModelSpec spec = fit.spec;
  const auto& parameters = fit.model->parameters();
  for (std::size_t i = 0; i < spec.effects.size(); ++i) {
    config::EffectSpec& line = spec.effects[i];
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (parameters[k].effect != line.effect) continue;
      std::string symbol = parameters[k].name;
      const auto dot = symbol.rfind("].");
      if (dot != std::string::npos) {
        if (!symbol.starts_with(fmt::format("{}[{}]", line.effect, i))) continue;
        symbol = symbol.substr(dot + 2);
      } else if (std::any_of(spec.effects.begin(),
                             spec.effects.begin() + static_cast<std::ptrdiff_t>(i),
                             [&](const auto& e) { return e.effect == line.effect; })) {
        continue;  // an earlier line of the same effect owns the plain name
      }
      line.parameters[symbol].start = fit.theta[k];
    }
  }
  return spec;
}

// kCurvePoints of a finer curve.
std::vector<double> thinned(const VectorXd& curve) {
  std::vector<double> some;
  for (Index i = 0; i < kCurvePoints; ++i)
    some.push_back(curve[i * curve.size() / kCurvePoints]);
  return some;
}

// Samples of a record's stretch that is drawn.
std::pair<Index, Index> drawn(const SampledRun& run) {
  const Index count = std::min<Index>(run.samples(), kStretchPoints);
  Index most = 0;
  run.v.cwiseAbs().maxCoeff(&most);
  const Index first = std::clamp<Index>(most - count / 4, 0, run.samples() - count);
  return {first, count};
}

RunCurves stretch_of(const RunDatum& datum, const VectorXd& before, const VectorXd& after) {
  const SampledRun& run = *datum.sampled;
  const auto [first, count] = drawn(run);
  const CosineTransform transform(run.samples());
  RunCurves curves;
  curves.name = datum.name;
  curves.from = run.start + run.dt * (static_cast<double>(first) + 0.5);
  curves.seconds = run.dt * static_cast<double>(count);
  curves.measured = list(transform.synthesise(datum.response).segment(first, count));
  curves.before = list(transform.synthesise(before).segment(first, count));
  curves.after = list(transform.synthesise(after).segment(first, count));
  curves.velocity = list(run.v.segment(first, count));
  return curves;
}

void thin(const MissingForce& before, const MissingForce& after, const SampledRun& run,
          RunCurves& curves) {
  const auto [first, count] = drawn(run);
  curves.force_before = list(before.force.segment(first, count));
  curves.force_after = list(after.force.segment(first, count));
}

VectorXd residual_of(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t r) {
  return data[r].response - fit.predictions[r].value();
}

double mean_square(const std::vector<VectorXd>& curves) {
  double sum = 0.0;
  for (const VectorXd& c : curves) {
    const double rms = root_mean_square(c);
    sum += rms * rms / static_cast<double>(curves.size());
  }
  return std::sqrt(sum);
}

// Residuals of what was not fitted: held-out runs, or else each run from the others.
std::vector<VectorXd> held_out(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  std::vector<VectorXd> residuals;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role == Role::held_out) residuals.push_back(residual_of(fit, data, r));
  }
  if (!residuals.empty()) return residuals;
  std::vector<VectorXd> left_out;
  if (!cross_validate(fit, data, &left_out)) return {};
  for (std::size_t r = 0; r < data.size(); ++r)
    residuals.push_back(coloured(data[r], left_out[r]));
  return residuals;
}

class Assembler {
 public:
  Assembler(const Naming& found, const std::vector<RunDatum>& data,
            const std::vector<SteadyRun>& runs, const std::vector<Candidate>& candidates)
      : found_(found),
        data_(data),
        runs_(runs),
        candidates_(candidates),
        before_(*found.base.fit),
        after_(chosen() != nullptr ? *chosen()->fit : before_),
        after_data_(chosen() != nullptr && chosen()->data ? *chosen()->data : data) {}

  Diagnosis run() {
    said_.verdict = found_.adequate    ? Verdict::adequate
                    : found_.explained ? Verdict::explained
                                       : Verdict::unexplained;
    said_.probability_before = found_.probability_base;
    said_.probability_after = found_.adequate ? found_.probability_base : found_.probability_best;
    said_.chi_squared_before = before_.chi_squared;
    said_.chi_squared_after = after_.chi_squared;
    said_.observations = before_.observations;
    said_.model = before_.spec.name;
    said_.parameters_before = describe(before_, data_);
    said_.parameters_after = describe(after_, data_);
    said_.improved = at_estimates(after_);
    weigh_hypotheses();
    gaps();
    forces();
    ranking();
    effects();
    return std::move(said_);
  }

 private:
  // The best hypothesis; where something unknown is left, the smallest one of which no larger one
  // halves what it leaves: a known effect must not be made to mend an unknown one.
  const Hypothesis* chosen() const {
    if (found_.adequate || found_.best >= found_.hypotheses.size()) return nullptr;
    const Hypothesis* best = &found_.hypotheses[found_.best];
    if (!counts(*best)) return nullptr;
    if (found_.explained) return best;
    const auto way = path();
    return way.empty() ? nullptr : way.back();
  }
  // From nothing, an effect more each.
  std::vector<const Hypothesis*> path() const {
    std::vector<const Hypothesis*> way;
    for (const Hypothesis* next = after(found_.base); next != nullptr; next = after(*next))
      way.push_back(next);
    return way;
  }
  // The next larger hypothesis that closes enough of what `smallest` leaves. Of those that close
  // nearly as much, the one with the fewest parameters: friction before hysteresis that can do what
  // friction does.
  const Hypothesis* after(const Hypothesis& smallest) const {
    const double next_effect = found_.by_gap ? kOfGap : kHalved;
    const double limit = &smallest == &found_.base ? kFirstEffect : next_effect;
    const auto larger = [&](const Hypothesis& h) {
      return counts(h) && h.effects.size() == smallest.effects.size() + 1 &&
             std::includes(h.effects.begin(), h.effects.end(), smallest.effects.begin(),
                           smallest.effects.end());
    };
    double least = limit;
    for (const Hypothesis& h : found_.hypotheses) {
      if (larger(h)) least = std::min(least, left_of(h, smallest));
    }
    const Hypothesis* next = nullptr;
    for (const Hypothesis& h : found_.hypotheses) {
      if (!larger(h)) continue;
      const double left = left_of(h, smallest);
      if (left >= limit || 1.0 - left < kNearlyAsMuch * (1.0 - least)) continue;
      const auto price = [](const Hypothesis& of) { return of.fit->free.size(); };
      if (next == nullptr || price(h) < price(*next) ||
          (price(h) == price(*next) && h.fit->chi_squared < next->fit->chi_squared))
        next = &h;
    }
    return next;
  }
  // Share of the gap's square that a fit leaves of another's, in units of the noise or in the
  // response's own: where the model is far from the data the noise says little of what matters.
  double left_of(const Hypothesis& one, const Hypothesis& other) const {
    double mine = 0.0, theirs = 0.0;
    for (std::size_t r = 0; r < data_.size(); ++r) {
      if (data_[r].role != Role::fit) continue;
      mine += std::pow(root_mean_square(residual_of(*one.fit, data_of(one), r)), 2);
      theirs += std::pow(root_mean_square(residual_of(*other.fit, data_of(other), r)), 2);
    }
    return std::min(one.fit->chi_squared / other.fit->chi_squared, mine / theirs);
  }
  const std::vector<RunDatum>& data_of(const Hypothesis& h) const {
    return h.data ? *h.data : data_;
  }
  static bool counts(const Hypothesis& h) {
    return h.disqualified.empty() && std::isfinite(h.fit->chi_squared);
  }

  // Shares of the probability among everything that was refitted, nothing, and the unknown. Where
  // the best leaves nothing but noise, the unknown has what the test of that leaves it; otherwise
  // all evidence counts by as much less as the best leaves more than noise, and no name is surer
  // than the share of the gap that it closes.
  void weigh_hypotheses() {
    double scale = 1.0;
    const Hypothesis* best = chosen();
    if (found_.explained) {
      most_ = 1.0 - unknown_share(found_.probability_best);
    } else if (!found_.adequate && best != nullptr) {
      const double freedom = before_.observations - static_cast<double>(best->fit->free.size());
      scale = std::max(1.0, best->fit->chi_squared / std::max(1.0, freedom));
      most_ = std::clamp(1.0 - left_of(*best, found_.base), 0.0, kMostUnexplained);
    }
    if (found_.by_gap) {
      double independent = 0.0;
      for (const RunDatum& datum : data_) {
        if (datum.role != Role::fit) continue;
        independent += datum.sampled ? kShareOfRecord * static_cast<double>(datum.response.size())
                                     : kIndependent;
      }
      scale = std::max(scale, before_.observations / independent);
    }
    const auto evidence = [&](const Hypothesis& h) { return h.log_evidence / scale; };
    // What is richer than the chosen one has been set aside for it; it stays among its rivals.
    const auto weighs = [&](const Hypothesis& h) {
      const bool richer = best != nullptr && (h.effects.size() > best->effects.size() ||
                                              h.fit->free.size() > best->fit->free.size());
      return counts(h) && !(found_.by_gap && richer);
    };
    double largest = evidence(found_.base);
    for (const Hypothesis& h : found_.hypotheses) {
      if (weighs(h)) largest = std::max(largest, evidence(h));
    }
    double sum = std::exp(evidence(found_.base) - largest);
    for (const Hypothesis& h : found_.hypotheses)
      sum += weighs(h) ? std::exp(evidence(h) - largest) : 0.0;
    for (const Hypothesis& h : found_.hypotheses)
      share_.push_back(weighs(h) ? most_ * std::exp(evidence(h) - largest) / sum : 0.0);
  }

  // Probability that something else is missing, given the probability p that noise alone makes what
  // is left: the largest evidence against noise is 1 / (-e p log p) (Sellke, Bayarri and Berger,
  // The American Statistician 55 (2001) 62-71).
  static double unknown_share(double p) {
    constexpr double kBefore = 0.02;  // of the unknown, before the data
    const double noise =
        p < std::exp(-1.0) ? -std::exp(1.0) * p * std::log(std::max(p, 1e-300)) : 1.0;
    return kBefore / (kBefore + (1.0 - kBefore) * noise);
  }

  double probability_of(const std::string& effect) const {
    double sum = 0.0;
    for (std::size_t h = 0; h < found_.hypotheses.size(); ++h) {
      // A richer effect that this fit reduces to the simpler one speaks for that.
      const auto& set = found_.hypotheses[h].effects;
      const bool holds = std::any_of(set.begin(), set.end(), [&](const std::string& e) {
        return e == effect || (simpler_than(e) == effect && reduces(*found_.hypotheses[h].fit, e));
      });
      if (holds) sum += share_[h];
    }
    return sum;
  }

  // What a fit leaves, less what the time base and the grid's limit leave open: the noise that one
  // expects given the residual.
  VectorXd noise_of(const HarmonicFit& fit, const std::vector<RunDatum>& data, double clock,
                    std::size_t r) const {
    VectorXd left = residual_of(fit, data, r);
    if (data[r].clock.size() > 0) left -= clock * data[r].clock;
    if (&data == &data_) return left;
    return covariance_of(data_[r]) *
           (data[r].whitening.triangularView<Eigen::Lower>().transpose() * whitened(data[r], left));
  }

  void gaps() {
    const double clock_before = clock_error(before_, data_);
    const double clock_after = clock_error(after_, after_data_);
    std::vector<VectorXd> before, after, noise;
    for (std::size_t r = 0; r < data_.size(); ++r) {
      const VectorXd b = noise_of(before_, data_, clock_before, r);
      const VectorXd a = noise_of(after_, after_data_, clock_after, r);
      const RunDatum& datum = data_[r];
      RunGap gap{datum.name,
                 datum.role,
                 datum.frequency_hz,
                 datum.driver.size() > 2 ? std::hypot(datum.driver[1], datum.driver[2]) : 0.0,
                 runs_[r].cycles(),
                 root_mean_square(b),
                 root_mean_square(a),
                 root_mean_square(datum.error)};
      said_.runs.push_back(std::move(gap));
      if (datum.role != Role::fit) continue;
      before.push_back(b);
      after.push_back(a);
      noise.push_back(datum.error);
    }
    said_.gap.before = mean_square(before);
    said_.gap.after = mean_square(after);
    said_.gap.noise_floor = mean_square(noise);
    const auto out_before = held_out(before_, data_);
    const auto out_after = held_out(after_, after_data_);
    if (!out_before.empty() && !out_after.empty()) {
      said_.gap.held_out_before = mean_square(out_before);
      said_.gap.held_out_after = mean_square(out_after);
    }
  }

  // The base model at the parameters that the larger one gives it: what the effect's force is.
  std::vector<double> unbent() const { return carried_over(*before_.model, after_); }

  void forces() {
    std::vector<MissingForce> before, after;
    const std::vector<double> theta = unbent();
    for (std::size_t r = 0; r < data_.size(); ++r) {
      const VectorXd& y = data_[r].response;
      before.push_back(missing_force(before_.predictions[r], before_.theta, y));
      after.push_back(missing_force(after_.predictions[r], after_.theta, y));
      effect_force_.push_back(missing_force(before_.predictions[r], theta, y));
      RunCurves curves;
      curves.name = data_[r].name;
      if (data_[r].sampled) {
        said_.curves.push_back(
            stretch_of(data_[r], before_.predictions[r].value(), after_.predictions[r].value()));
        thin(before.back(), after.back(), *data_[r].sampled, said_.curves.back());
        continue;
      }
      const auto synthesis = synthesis_matrix(data_[r].harmonics(), kCurvePoints);
      curves.measured = list(synthesis * y);
      curves.before = list(synthesis * before_.predictions[r].value());
      curves.after = list(synthesis * after_.predictions[r].value());
      curves.velocity = thinned(before.back().velocity);
      curves.force_before = thinned(before.back().force);
      curves.force_after = thinned(after.back().force);
      said_.curves.push_back(std::move(curves));
    }
    said_.location = locate(before, after, data_);
    double total = 0.0;
    for (std::size_t r = 0; r < data_.size(); ++r) {
      if (data_[r].sampled) continue;  // has no harmonics
      const VectorXd e = residual_of(before_, data_, r);
      for (Index c = 0; c < e.size(); ++c) {
        const auto h = static_cast<std::size_t>(harmonic_order(c));
        if (said_.location.share_of_harmonic.size() <= h)
          said_.location.share_of_harmonic.resize(h + 1, 0.0);
        const double power = (c == 0 ? 1.0 : 0.5) * e[c] * e[c];
        said_.location.share_of_harmonic[h] += power;
        total += power;
      }
    }
    for (double& share : said_.location.share_of_harmonic)
      share /= total > 0.0 ? total : 1.0;
  }

  void ranking() {
    for (const Candidate& candidate : candidates_) {
      Ranked ranked;
      ranked.name = std::string(candidate.effect->name());
      ranked.hidden = 1.0;
      for (std::size_t k = 0; k < found_.base_scoring.scores.size(); ++k) {
        const Score& s = found_.base_scoring.scores[k];
        if (s.candidate != &candidate) continue;
        ranked.hidden = std::min(ranked.hidden, found_.base_scoring.design.signatures[k].hidden);
        ranked.gain = std::max(ranked.gain, s.gain);
      }
      for (const Hypothesis& h : found_.hypotheses) {
        if (h.effects.size() != 1 || h.effects[0] != ranked.name) continue;
        ranked.disqualified = h.disqualified;
        if (!std::isfinite(h.fit->chi_squared)) continue;
        ranked.gain_refitted = before_.chi_squared - h.fit->chi_squared;
        if (h.cross_validated && found_.base.cross_validated)
          ranked.cross_validated = *h.cross_validated - *found_.base.cross_validated;
      }
      ranked.probability = probability_of(ranked.name);
      said_.ranking.push_back(std::move(ranked));
    }
    std::stable_sort(said_.ranking.begin(), said_.ranking.end(),
                     [](const Ranked& a, const Ranked& b) {
                       if (a.probability != b.probability) return a.probability > b.probability;
                       return a.gain_refitted.value_or(a.gain) > b.gain_refitted.value_or(b.gain);
                     });
  }

  // Effects that would do in the place of `effect` as well, as far as this campaign says.
  std::vector<std::string> rivals(const std::string& effect) const {
    const Hypothesis& best = *chosen();
    std::vector<std::string> others;
    for (const std::string& e : best.effects) {
      if (e != effect) others.push_back(e);
    }
    std::vector<std::string> set;
    for (const Hypothesis& h : found_.hypotheses) {
      if (!h.disqualified.empty() || h.effects.size() != best.effects.size()) continue;
      if (h.log_evidence < best.log_evidence - kInTheSet) continue;
      std::string other;
      int unshared = 0;
      for (const std::string& e : h.effects) {
        if (std::find(others.begin(), others.end(), e) != others.end()) continue;
        other = e;
        ++unshared;
      }
      if (unshared == 1 && other != effect) set.push_back(other);
    }
    if (!others.empty()) return set;
    // Those that were not worth a refit by a hair.
    double own = 0.0;
    for (const Score& s : found_.base_scoring.scores) {
      if (s.candidate->effect->name() == effect) own = std::max(own, s.gain);
    }
    for (const Score& s : found_.base_scoring.scores) {
      const std::string other(s.candidate->effect->name());
      const bool refitted = std::any_of(
          found_.hypotheses.begin(), found_.hypotheses.end(),
          [&](const Hypothesis& h) { return h.effects.size() == 1 && h.effects[0] == other; });
      if (refitted || other == effect || s.gain < own - kGainInTheSet) continue;
      if (std::find(set.begin(), set.end(), other) == set.end()) set.push_back(other);
    }
    return set;
  }

  // Compared with the corners as round as they are in those that were not made sharper.
  static const HarmonicFit& rounded(const Hypothesis& h) { return h.rounded ? *h.rounded : *h.fit; }
  // Fits in which a rival stands in the place of `effect`; not those that are reduced to it, which
  // no run tells apart.
  std::vector<const HarmonicFit*> rival_fits(const std::string& effect) const {
    std::vector<const HarmonicFit*> fits;
    for (const std::string& rival : rivals(effect)) {
      std::vector<std::string> effects = chosen()->effects;
      std::replace(effects.begin(), effects.end(), effect, rival);
      std::sort(effects.begin(), effects.end());
      for (const Hypothesis& h : found_.hypotheses) {
        const bool same = simpler_than(rival) == effect && reduces(*h.fit, rival);
        if (h.effects == effects && !same && std::isfinite(h.fit->chi_squared))
          fits.push_back(&rounded(h));
      }
    }
    return fits;
  }

  void effects() {
    const Hypothesis* best = chosen();
    if (best == nullptr) return;
    for (const std::string& effect : best->effects) {
      NamedEffect named;
      named.name = effect;
      if (const Effect* known = find_effect(effect)) {
        named.formula = std::string(known->formula());
        named.meaning = std::string(known->meaning());
      }
      named.probability = probability_of(effect);
      for (const ParameterEstimate& p : said_.parameters_after) {
        if (p.effect == effect) named.parameters.push_back(p);
      }
      named.confusable_with = rivals(effect);
      named.split_by = splitting_run(rounded(*best), rival_fits(effect), data_);
      double share = 0.0;
      const std::string words = where(effect_force_, data_, &share);
      named.where = fmt::format("{} ({:.0f} % of its force)", words, 100.0 * share);
      if (said_.gap.held_out_before && *said_.gap.held_out_before > 0.0)
        named.held_out_gain = 1.0 - *said_.gap.held_out_after / *said_.gap.held_out_before;
      said_.effects.push_back(std::move(named));
    }
    if (found_.explained) {
      std::stable_sort(
          said_.effects.begin(), said_.effects.end(),
          [](const NamedEffect& a, const NamedEffect& b) { return a.probability > b.probability; });
      return;
    }
    // In the order in which they close the gap.
    const auto way = path();
    const auto rank = [&](const NamedEffect& e) {
      return std::find_if(way.begin(), way.end(), [&](const Hypothesis* h) {
        return std::find(h->effects.begin(), h->effects.end(), e.name) != h->effects.end();
      });
    };
    std::stable_sort(said_.effects.begin(), said_.effects.end(),
                     [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  }

  const Naming& found_;
  const std::vector<RunDatum>& data_;
  const std::vector<SteadyRun>& runs_;
  const std::vector<Candidate>& candidates_;
  const HarmonicFit& before_;
  const HarmonicFit& after_;
  const std::vector<RunDatum>& after_data_;  // those that it was fitted to
  Diagnosis said_;
  std::vector<double> share_;  // of each hypothesis
  double most_ = 1.0;          // probability that a name can have
  std::vector<MissingForce> effect_force_;
};

}  // namespace

Diagnosis assemble(const Naming& found, const std::vector<RunDatum>& data,
                   const std::vector<SteadyRun>& runs, const std::vector<Candidate>& candidates) {
  return Assembler(found, data, runs, candidates).run();
}

}  // namespace shaker::estimator::discrepancy
