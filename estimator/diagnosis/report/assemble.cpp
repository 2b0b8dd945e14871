#include "estimator/diagnosis/report/internal/assemble.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/force/internal/inverse_dynamics.hpp"
#include "estimator/diagnosis/force/internal/remaining_force.hpp"
#include "estimator/diagnosis/noise/internal/own_forces.hpp"
#include "estimator/diagnosis/report/internal/choice.hpp"
#include "estimator/diagnosis/report/internal/curves.hpp"
#include "estimator/diagnosis/report/internal/discriminating_run.hpp"
#include "estimator/diagnosis/report/internal/effect_sizes.hpp"
#include "estimator/diagnosis/report/internal/estimates.hpp"
#include "estimator/diagnosis/report/internal/gaps.hpp"
#include "estimator/diagnosis/report/internal/hypotheses.hpp"
#include "estimator/diagnosis/report/internal/indistinguishable_set.hpp"
#include "estimator/diagnosis/report/internal/model_probabilities.hpp"
#include "estimator/diagnosis/select/internal/centring.hpp"
#include "estimator/diagnosis/select/internal/families.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/scaled.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;

constexpr std::string_view kReferenceSpeed = "v_r";  // of power_damping
constexpr double kLeastOfKind = 0.01;  // of a probability, that is told among those of its kind

class Assembler {
 public:
  Assembler(const Selection& found, const std::vector<RunDatum>& data,
            const std::vector<SteadyRun>& runs, const std::vector<Candidate>& candidates,
            const std::vector<RunDatum>& measured)
      : found_(found),
        data_(data),
        measured_(measured),
        runs_(runs),
        candidates_(candidates),
        choice_(found, data),
        weights_(found, data),
        probabilities_(found, data, agree(found, data, choice_)),
        before_(*found.base.fit),
        after_(choice_.chosen() != nullptr ? *choice_.chosen()->fit : before_),
        after_data_(choice_.chosen() != nullptr && choice_.chosen()->data ? *choice_.chosen()->data
                                                                          : data) {}

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
    said_.parameters_before = diagnosis::describe(before_, data_);
    said_.parameters_after = diagnosis::describe(after_, data_, places());
    said_.own_forces = own_forces_of(after_, data_);
    said_.improved = at_estimates(after_);
    if (at_limit()) said_.improved = stated_sharp(said_.improved);
    state_scaled(said_.improved);
    const double level =
        tell_gaps({before_, data_}, {after_, after_data_}, data_, measured_, runs_, said_);
    hold_to_gap();
    hold_to_held_out(level);
    said_.cut_short = found_.cut_short;
    tell_stopped_sets();
    forces();
    ranking();
    effects();
    kinds();
    said_.damper = identified_damper(found_, data_, choice_, probabilities_, said_, known_priors_);
    return std::move(said_);
  }

 private:
  std::vector<FittedConstant> places() const {
    const Hypothesis* best = choice_.chosen();
    if (best == nullptr) return {};
    return places_of(*best, data_, before_.spec.effects.size());
  }

  // What the model that comes out was held against had corners of no width.
  bool at_limit() const {
    if (after_.at_once) return true;
    const auto& data = choice_.chosen() != nullptr ? choice_.chosen()->data : found_.base.data;
    return data && std::any_of(data->begin(), data->end(),
                               [](const RunDatum& datum) { return datum.to_limit != nullptr; });
  }

  // The test looks at all data together, in units of the noise; what is said of the gap in the
  // response's own unit must not contradict it.
  void hold_to_gap() {
    const bool far = said_.gap.after > kExplainedGap * said_.gap.noise_floor;
    if (said_.verdict != Verdict::explained || !far) return;
    said_.verdict = Verdict::unexplained;
    trusted_ = kMostUnexplained;
    said_.warnings.push_back(fmt::format(
        "what is left passes the test for noise, but its root mean square is {:.1f} times the "
        "noise floor: that is not called explained",
        said_.gap.after / said_.gap.noise_floor));
  }

  // What explains the runs that it was fitted to must not make others worse than it would by
  // chance. `level`: of tell_gaps.
  void hold_to_held_out(double level) {
    if (said_.verdict != Verdict::explained || !said_.gap.held_out_after) return;
    const double before = *said_.gap.held_out_before, after = *said_.gap.held_out_after;
    if (choice_.chosen() == nullptr || after < before || after < level) return;
    said_.verdict = Verdict::unexplained;
    const auto named = static_cast<int>(choice_.chosen()->effects.size());
    trusted_ = std::min(kMostUnexplained, chance_beside_unknown(1.0, named));
    said_.warnings.push_back(
        fmt::format("what is left passes the test for noise, but on data that were not fitted the "
                    "gap is {:.3g} times what it is without the named effects: that is not called "
                    "explained",
                    after / before));
  }

  // Single effects stand under not_tried.
  void tell_stopped_sets() {
    std::string sets;
    for (const Hypothesis& h : found_.hypotheses) {
      if (h.fit->stopped && h.effects.size() > 1)
        sets += fmt::format("{}{}", sets.empty() ? "" : "; ", fmt::join(h.effects, " with "));
    }
    if (!sets.empty())
      said_.warnings.push_back(fmt::format("not tried together: {}: {}", sets, kTooLong));
  }

  void forces() {
    std::vector<MissingForce> before, after;
    // The base model at the parameters that the larger one gives it: what the effect's force is.
    const std::vector<double> unbent = carried_over(*before_.model, after_);
    for (std::size_t r = 0; r < data_.size(); ++r) {
      const VectorXd& y = data_[r].response;
      before.push_back(missing_force(before_.predictions[r], before_.theta, y));
      after.push_back(missing_force(after_.predictions[r], after_.theta, y));
      effect_force_.push_back(missing_force(before_.predictions[r], unbent, y));
      said_.curves.push_back(curves_of(data_[r], before_.predictions[r].value(),
                                       after_.predictions[r].value(), before.back(), after.back()));
    }
    said_.location = locate(before, after, data_);
    if (said_.verdict == Verdict::unexplained)
      said_.remaining = remaining_force(after_, after_data_, found_.by_gap, known_priors_);
    said_.location.share_of_harmonic = share_of_harmonic(before_, data_);
  }

  void ranking() {
    for (const Candidate& candidate : candidates_) {
      Ranked ranked;
      ranked.name = candidate.name();
      ranked.hidden = 1.0;
      for (std::size_t k = 0; k < found_.base_scoring.scores.size(); ++k) {
        const Score& s = found_.base_scoring.scores[k];
        if (s.candidate != &candidate) continue;
        ranked.hidden = std::min(ranked.hidden, found_.base_scoring.design.signatures[k].hidden);
        ranked.gain = std::max(ranked.gain, s.gain);
      }
      const NotScored* failed = not_scored(candidate);
      std::string trouble = failed != nullptr ? failed->reason : "";
      for (const Hypothesis& h : found_.hypotheses) {
        if (h.effects.size() != 1 || h.effects[0] != ranked.name) continue;
        ranked.disqualified = h.disqualified;
        if (h.fit->stopped) trouble = kTooLong;
        if (!std::isfinite(h.fit->chi_squared)) continue;
        ranked.gain_refitted = before_.chi_squared - h.fit->chi_squared;
        if (h.cross_validated && found_.base.cross_validated)
          ranked.cross_validated = *h.cross_validated - *found_.base.cross_validated;
      }
      if (!trouble.empty() && !ranked.gain_refitted) {
        said_.not_tried.push_back({std::move(ranked.name), std::move(trouble), true});
        continue;
      }
      ranked.probability = trusted_ * probabilities_.probability_of(ranked.name);
      said_.ranking.push_back(std::move(ranked));
    }
    std::stable_sort(said_.ranking.begin(), said_.ranking.end(),
                     [](const Ranked& a, const Ranked& b) {
                       if (a.probability != b.probability) return a.probability > b.probability;
                       return a.gain_refitted.value_or(a.gain) > b.gain_refitted.value_or(b.gain);
                     });
  }

  const NotScored* not_scored(const Candidate& candidate) const {
    const auto& all = found_.base_scoring.not_scored;
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const NotScored& n) { return n.candidate == &candidate; });
    return found == all.end() ? nullptr : &*found;
  }

  void effects() {
    const Hypothesis* best = choice_.chosen();
    if (best == nullptr) return;
    for (const std::string& effect : best->effects) {
      NamedEffect named;
      named.name = effect;
      describe(named);
      named.probability = trusted_ * probabilities_.probability_of(effect);
      for (const ParameterEstimate& p : said_.parameters_after) {
        if (p.effect == effect) named.parameters.push_back(p);
      }
      named.confusable_with = indistinguishable_set(effect, found_, *best, weights_);
      named.discriminating_run = discriminating_run(
          rounded(*best), indistinguishable_fits(effect, found_, *best, weights_), data_);
      double share = 0.0;
      const std::string words = where(effect_force_, data_, &share);
      named.where = fmt::format("{} ({:.0f} % of its force)", words, 100.0 * share);
      if (said_.gap.held_out_before && *said_.gap.held_out_before > 0.0)
        named.held_out_gain = 1.0 - *said_.gap.held_out_after / *said_.gap.held_out_before;
      said_.effects.push_back(std::move(named));
    }
    // In the order of what each makes of the response, as far as it is likely.
    std::map<std::string, double> weight;
    for (const NamedEffect& e : said_.effects)
      weight[e.name] =
          e.probability *
          std::pow(size_of(after_, after_data_, before_.spec.effects.size(), e.name), 2);
    std::stable_sort(said_.effects.begin(), said_.effects.end(),
                     [&](const auto& a, const auto& b) { return weight[a.name] > weight[b.name]; });
  }

  // What its parameters are meant for, where the motion says it.
  void tell_references(const Effect& known, const config::EffectSpec& line,
                       NamedEffect& named) const {
    for (const ConstantInfo& info : known.constants()) {
      const auto stated = line.constants.find(std::string(info.symbol));
      if (stated != line.constants.end() && (info.reach || info.symbol == kReferenceSpeed))
        named.meaning += fmt::format("; {} = {:.3g} {}{}", info.symbol, stated->second,
                                     said_.improved.length_unit, info.reach ? "" : "/s");
    }
  }

  // Words and formula.
  void describe(NamedEffect& named) const {
    const Effect* known = find_effect(named.name);
    if (known == nullptr) return;
    named.formula = std::string(known->formula());
    named.meaning = std::string(known->meaning());
    const std::string_view input = config::driven(named.name).input;
    for (const config::EffectSpec& line : said_.improved.effects) {
      if (line.effect != named.name) continue;
      tell_references(*known, line, named);
      if (input.empty()) continue;
      named.formula = fmt::format("({}) {} / {:g}", named.formula, input, *line.reference);
      named.meaning += fmt::format(", in proportion to {}", input);
    }
  }

  // Of the named effects, where more than one of a kind may be what is missing.
  void kinds() {
    std::set<const EffectKind*> told;
    for (const NamedEffect& named : said_.effects) {
      const EffectKind* kind = kind_of(named.name);
      if (kind == nullptr || !told.insert(kind).second) continue;
      KindShare share;
      share.name = std::string(kind->name);
      std::vector<std::string> all;
      for (const Candidate& candidate : candidates_) {
        if (kind_of(candidate.name()) != kind) continue;
        all.push_back(candidate.name());
        const double probability = trusted_ * probabilities_.probability_of(all.back());
        if (probability >= kLeastOfKind) share.members.push_back({all.back(), probability});
      }
      if (share.members.size() < 2) continue;
      std::stable_sort(share.members.begin(), share.members.end(),
                       [](const auto& a, const auto& b) { return a.probability > b.probability; });
      share.probability = trusted_ * probabilities_.probability_of_any(all);
      said_.kinds.push_back(std::move(share));
    }
  }

  const Selection& found_;
  const std::vector<RunDatum>& data_;
  const std::vector<RunDatum>& measured_;
  const std::vector<SteadyRun>& runs_;
  const std::vector<Candidate>& candidates_;
  Choice choice_;
  const Weights weights_;
  const ModelProbabilities probabilities_;
  double trusted_ = 1.0;  // of the probabilities
  const HarmonicFit& before_;
  const HarmonicFit& after_;
  const std::vector<RunDatum>& after_data_;  // those that it was fitted to
  Diagnosis said_;
  std::vector<MissingForce> effect_force_;
  SeenPriors known_priors_;
};

}  // namespace

Diagnosis assemble(const Selection& found, const std::vector<RunDatum>& data,
                   const std::vector<SteadyRun>& runs, const std::vector<Candidate>& candidates,
                   const std::vector<RunDatum>& measured) {
  if (data.size() == runs.size()) return Assembler(found, data, runs, candidates, measured).run();
  // What is shown is the displacement; further channels stand behind it.
  const auto shown = [&](const std::vector<RunDatum>& all) {
    return std::vector<RunDatum>(all.begin(),
                                 all.begin() + static_cast<std::ptrdiff_t>(runs.size()));
  };
  Selection of_runs = found;
  for (Hypothesis& h : of_runs.hypotheses) {
    if (h.data) h.data = std::make_shared<const std::vector<RunDatum>>(shown(*h.data));
  }
  const std::vector<RunDatum> main = shown(data);
  return Assembler(of_runs, main, runs, candidates, measured).run();
}

}  // namespace shaker::estimator::diagnosis
