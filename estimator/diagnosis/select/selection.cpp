#include "estimator/diagnosis/select/internal/selection.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/internal/motion_range.hpp"
#include "estimator/diagnosis/select/internal/candidate_set.hpp"
#include "estimator/diagnosis/select/internal/centring.hpp"
#include "estimator/diagnosis/select/internal/families.hpp"
#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "estimator/diagnosis/select/internal/pairs.hpp"
#include "estimator/diagnosis/select/internal/probe_order.hpp"
#include "estimator/diagnosis/select/internal/refits.hpp"
#include "estimator/diagnosis/select/internal/scored_forces.hpp"
#include "estimator/diagnosis/select/internal/weights.hpp"
#include "estimator/model/effects/turning.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr int kExchanges = 2;  // for each effect of the best
constexpr int kPairs = 3;      // of effects that only act together
// Effects by which a hypothesis of one effect is extended, and one of more.
constexpr int kExtensionsOfOne = 8, kExtensionsOfMore = 4;
constexpr double kNearlyAll = 0.01;  // of chi-squared, left by one effect that closes the gap alone
constexpr double kMaxNearRatio = 4.0;       // of chi-squared, times the best one's
constexpr double kMaxWrongValley = 16.0;    // the same, of one that may stand in another valley
constexpr double kMaxRemainingShare = 0.5;  // of chi-squared, that one more must leave at most

// In a search by shares of the gap, the base model's probability only decides whether its corners
// are made narrower.
bool has_corners(const config::ModelSpec& spec) {
  return has_smoothing(spec) || !turnings_of(spec).empty();
}

class Search {
 public:
  Search(Selection& found, const std::vector<RunDatum>& data, const std::vector<Candidate>& all,
         const SelectionOptions& options, const std::function<void(double)>& progress)
      : found_(found),
        data_(data),
        all_(all),
        options_(options),
        progress_(progress),
        refits_(*found.base.fit, data, options.fit,
                options.by_gap ? Errors::residual : Errors::noise),
        candidate_set_(found, data, all, options, refits_) {}

  void judge_base() {
    // An effect without a coefficient is probed where it acts, which may be far from the fit. This
    // is done once; later, or if an earlier search has done so, only nearby values are tried.
    FitOptions far = options_.fit;
    far.from_rest = !options_.by_gap;
    found_.base_scoring = score(*found_.base.fit, data_, all_, far, nullptr, options_.probed);
    if (!options_.by_gap || has_corners(found_.base.fit->spec)) {
      found_.probability_base = candidate_set_.probability(found_.base_scoring);
      found_.adequate = found_.probability_base > options_.false_alarm_rate;
    }
    refits_.describe(found_.base);
    if (!found_.adequate) narrow_base();
  }

  void run() {
    std::vector<std::size_t> level = begin_known();
    const auto extend_base = [&](const Scoring& scoring) {
      std::ranges::copy(extend(found_.base, scoring, options_.refits), std::back_inserter(level));
    };
    if (const auto forces = scored_by_forces(*found_.base.fit, data_, all_, options_.fit))
      extend_base(*forces);
    extend_base(found_.base_scoring);
    candidate_set_.choose();
    if (!options_.by_gap && begin_near_ones_elsewhere(level)) candidate_set_.choose();
    if (options_.known != nullptr) prune();
    if (!candidate_set_.settled() && !options_.by_gap && candidate_set_.goes_on()) {
      begin_elsewhere(level);
      candidate_set_.choose();
    }
    if (candidate_set_.chosen()) begin_kin();
    for (int size = 2; size <= options_.most_effects && !candidate_set_.settled(); ++size) {
      if (!candidate_set_.goes_on()) break;
      progress_(0.4 + 0.2 * size);
      std::vector<std::size_t> next;
      if (size == 2) begin_pairs(next);
      candidate_set_.sort_by_evidence(level);
      for (std::size_t i = 0; i < level.size() && i < 2U; ++i) {
        // A copy: extending the search makes the vector grow.
        const Hypothesis parent = found_.hypotheses[level[i]];
        const auto& scoring = candidate_set_.scored(parent.rounded ? parent.rounded : parent.fit);
        for (const std::size_t h :
             extend(parent, scoring, size == 2 ? kExtensionsOfOne : kExtensionsOfMore))
          next.push_back(h);
      }
      if (next.empty()) break;
      level = std::move(next);
      const double before = candidate_set_.left_by_best();
      candidate_set_.choose();
      prune();
      if (!options_.by_gap && candidate_set_.left_by_best() > kMaxRemainingShare * before) break;
    }
    while (exchanged())
      candidate_set_.choose();
  }

 private:
  // A base model with dry friction is compared with the data both with the stated smoothing width
  // (of its file or of the catalogue) and with zero width.
  void narrow_base() {
    Hypothesis sharp = found_.base;
    if (!refits_.narrowed(sharp) || sharp.fit->chi_squared >= found_.base.fit->chi_squared) return;
    found_.base = std::move(sharp);
    found_.base_scoring = candidate_set_.scored(found_.base);
    found_.probability_base = candidate_set_.probability(found_.base_scoring);
    found_.adequate = found_.probability_base > options_.false_alarm_rate;
  }

  // Refits the known hypothesis. If it is not admissible with these errors, it without one of its
  // effects may be: such sets that leave little more than noise start from its parameters. Returns
  // the new hypotheses with one effect.
  std::vector<std::size_t> begin_known() {
    std::vector<std::size_t> made;
    if (options_.known == nullptr) return made;
    const Hypothesis known = refits_.again(*options_.known);
    candidate_set_.keep(known, made);
    const double near = kMaxNearRatio * known.fit->observations;
    if (!known.disqualified.empty()) keep_without(known, made, near);
    std::erase_if(made, [&](std::size_t h) { return found_.hypotheses[h].effects.size() > 1; });
    return made;
  }

  // Removes each effect of a hypothesis in turn, and keeps those results that leave at most `most`.
  void keep_without(const Hypothesis& full, std::vector<std::size_t>& made,
                    double most = std::numeric_limits<double>::infinity()) {
    if (full.effects.size() < 2) return;
    for (std::size_t out = found_.base.fit->spec.effects.size();
         out < full.fit->spec.effects.size(); ++out) {
      Hypothesis less = refits_.without(full, out);
      if (less.fit->chi_squared <= most) candidate_set_.keep(std::move(less), made);
    }
  }

  // The effects by which `parent` is extended: the `most` that gain most. An effect without a
  // coefficient is scored at a guess of its shape, far from its end values. The score says little, so
  // all such effects are tried once.
  std::vector<OrderedProbe> to_try(const Hypothesis& parent, const Scoring& scoring, int most) {
    std::vector<OrderedProbe> probes = ordered(scoring);
    int tried = 0;
    std::erase_if(probes, [&](const OrderedProbe& next) {
      const bool guessed = next.probe->coefficients.empty() && parent.effects.empty();
      if (tried >= most && !guessed) return true;
      const std::string& added = next.candidate->name();
      // Of an effect and its special case only one is wanted.
      const auto stands = [&](const std::string& e) { return e == added || related(e, added); };
      if (std::any_of(parent.effects.begin(), parent.effects.end(), stands)) return true;
      std::vector<std::string> effects = parent.effects;
      effects.insert(std::upper_bound(effects.begin(), effects.end(), added), added);
      if (candidate_set_.find(effects) != nullptr) return true;
      tried += guessed ? 0 : 1;
      return false;
    });
    put_memory_last(probes);
    return probes;
  }

  std::vector<std::size_t> extend(const Hypothesis& parent, const Scoring& scoring, int most) {
    std::vector<std::size_t> made;
    for (const OrderedProbe& next : to_try(parent, scoring, most)) {
      // Single effects compete with each other: the probability of one depends on all of them.
      if (!parent.effects.empty() && !candidate_set_.goes_on()) break;
      made.push_back(found_.hypotheses.size());
      found_.hypotheses.push_back(refits_.with(parent, *next.probe));
      refits_.know_left(found_.hypotheses.back());
      keep_what_remains(found_.hypotheses.back(), made);
    }
    begin_at_special_cases(made);
    std::erase_if(
        made, [&](std::size_t h) { return !std::isfinite(found_.hypotheses[h].fit->chi_squared); });
    return made;
  }

  // The pairs that gain most of those that no single score announces.
  void begin_pairs(std::vector<std::size_t>& made) {
    if (candidate_set_.left_by_best() < kNearlyAll * found_.base.fit->chi_squared) return;
    int tried = 0;
    for (const PairScore& pair : joint_scores(found_.base_scoring, kMinRefitGain)) {
      if (tried == kPairs || !candidate_set_.goes_on()) return;
      const Score& first = found_.base_scoring.scores[pair.first];
      const Score& second = found_.base_scoring.scores[pair.second];
      const std::string &one = first.candidate->name(), &other = second.candidate->name();
      if (candidate_set_.find({std::min(one, other), std::max(one, other)}) != nullptr) continue;
      ++tried;
      const Hypothesis* known = candidate_set_.find({one});
      const Hypothesis alone =
          known != nullptr ? *known
                           : refits_.with(found_.base, first.candidate->probes[first.probe]);
      if (std::isfinite(alone.fit->chi_squared))
        candidate_set_.keep(refits_.with(alone, second.candidate->probes[second.probe]), made);
    }
  }

  // A richer effect leaves no more than its special case. Where its fit does, that ended in another
  // valley, and starts from the special case.
  void begin_at_special_cases(const std::vector<std::size_t>& made) {
    for (const std::size_t k : made) {
      const Hypothesis richer = found_.hypotheses[k];  // a copy: it may be replaced
      for (const std::string& effect : richer.effects) {
        for (const std::string& simpler : simpler_than(effect))
          begin_at_special_case(richer, effect, simpler);
      }
    }
  }

  void begin_at_special_case(const Hypothesis& richer, const std::string& effect,
                             const std::string& simpler) {
    if (!holds_all_of(effect, simpler) || reduces(*richer.fit, effect)) return;
    const Hypothesis* special = candidate_set_.find(with_instead(richer.effects, effect, simpler));
    if (special == nullptr || richer.fit->stopped || !special->disqualified.empty() ||
        rounded(*special).chi_squared >= rounded(richer).chi_squared)
      return;
    const auto candidate = std::find_if(all_.begin(), all_.end(),
                                        [&](const Candidate& c) { return c.name() == effect; });
    std::vector<std::size_t> replaced;
    if (candidate != all_.end() && candidate_set_.goes_on())
      candidate_set_.keep(refits_.with_instead(*special, simpler, candidate->probes.front().line),
                          replaced);
  }

  // A fit that switched an effect off belongs to the smaller set. That set may have ended in a
  // worse valley by itself; then it takes over this fit.
  void keep_what_remains(const Hypothesis& full, std::vector<std::size_t>& made) {
    const auto off = refits_.switched_off(full);
    if (!off || full.effects.size() < 2) return;
    std::vector<std::string> effects = full.effects;
    std::erase(effects, full.fit->spec.effects[*off].effect);
    const Hypothesis* known = candidate_set_.find(effects);
    if (known != nullptr &&
        !(full.fit->chi_squared < kMaxRemainingShare * rounded(*known).chi_squared))
      return;
    candidate_set_.keep(refits_.without(full, *off), made);
    const Hypothesis* now = candidate_set_.find(effects);  // none where it has no solution
    if (now == nullptr) return;
    const auto kept = static_cast<std::size_t>(now - found_.hypotheses.data());
    if (std::find(made.begin(), made.end(), kept) == made.end()) made.push_back(kept);
  }

  // Of effects that do nearly the same alone, only one may have been extended. In the hypothesis
  // that weighs most, each effect gives its place to those that gain most beside the others.
  // Returns true if another hypothesis weighs most then.
  bool exchanged() {
    const auto heaviest = [&] {
      const auto any = [](const Hypothesis&) { return true; };
      const Hypothesis* h =
          Weights(found_, data_).heaviest(static_cast<std::size_t>(options_.most_effects), any);
      return h == nullptr ? Hypothesis() : *h;
    };
    const Hypothesis best = heaviest();  // a copy: they become more
    if (best.effects.size() < 2) return false;
    std::vector<std::size_t> made;
    for (std::size_t line = found_.base.fit->spec.effects.size();
         line < best.fit->spec.effects.size(); ++line) {
      if (!candidate_set_.goes_on()) return false;
      std::vector<std::string> others = best.effects;
      std::erase(others, best.fit->spec.effects[line].effect);
      if (candidate_set_.find(others) == nullptr)
        candidate_set_.keep(refits_.without(best, line), made);
      const Hypothesis* known = candidate_set_.find(others);
      if (known == nullptr || !std::isfinite(known->fit->chi_squared)) continue;
      const Hypothesis parent = *known;
      extend(parent, candidate_set_.scored(parent.rounded ? parent.rounded : parent.fit),
             kExchanges);
    }
    return heaviest().effects != best.effects;
  }

  // Springs that do nearly the same may have ended in valleys of their own. Each begins from the best one.
  void begin_kin() {
    const Hypothesis best = found_.hypotheses[found_.best];  // a copy: they become more
    const EffectKind* kind = kind_of(best.effects.front());
    if (best.effects.size() != 1 || kind == nullptr) return;
    const MotionRange motion = range_of(data_);
    std::vector<std::size_t> made;
    for (const Candidate& candidate : all_) {
      const std::string& kin = candidate.name();
      if (kind_of(kin) != kind || kin == best.effects.front() ||
          config::driven(kin).input != config::driven(best.effects.front()).input)
        continue;
      const auto line = same_slope(*best.fit, found_.base.fit->spec.effects.size(),
                                   candidate.probes.front().line, motion);
      if (line && candidate_set_.goes_on())
        candidate_set_.keep(refits_.with_instead(best, best.effects.front(), *line), made);
    }
    candidate_set_.choose();
  }

  // If the base model has bent far, an effect may have no gain at its fit, or may end in a valley
  // of its own. Before a pair is believed, each single effect is tried from where it acts.
  void begin_elsewhere(std::vector<std::size_t>& level) {
    for (const Candidate& candidate : all_) {
      if (!candidate_set_.goes_on()) return;
      const std::string& effect = candidate.name();
      const Hypothesis* known = candidate_set_.find({effect});
      if (known != nullptr && known->fit->stopped) continue;
      const auto& failed = found_.base_scoring.not_scored;
      if (std::any_of(failed.begin(), failed.end(),
                      [&](const NotScored& n) { return n.candidate == &candidate && n.stopped; }))
        continue;
      const double own = known != nullptr ? known->fit->chi_squared : candidate_set_.left_by_best();
      const auto probe = candidate.probes[candidate.probes.size() / 2];
      auto h = refits_.elsewhere(probe,
                                 kMaxRemainingShare * std::min(own, candidate_set_.left_by_best()));
      if (h) candidate_set_.keep(std::move(*h), level);
    }
  }

  // An effect that the base parameters imitate nearly completely (a real gas) has two valleys, one
  // on either side of its absent value, and a fit ends in one of them. If one effect leaves little
  // more than noise, it and those near it are started where they act too. Returns false if none is
  // better.
  bool begin_near_ones_elsewhere(std::vector<std::size_t>& level) {
    const double best = candidate_set_.left_by_best();
    if (!candidate_set_.chosen() || best > kMaxNearRatio * found_.base.fit->observations)
      return false;
    const double near = kMaxWrongValley * best;
    bool better = false;
    for (const Candidate& candidate : all_) {
      const Hypothesis* known = candidate_set_.find({candidate.name()});
      if (known == nullptr || known->rounded || !(known->fit->chi_squared < near)) continue;
      const double own = known->fit->chi_squared;
      auto h =
          refits_.elsewhere(candidate.probes[candidate.probes.size() / 2], own - kMinRefitGain);
      if (!h || !(h->fit->chi_squared < own)) continue;
      candidate_set_.keep(std::move(*h), level);
      better = true;
    }
    return better;
  }

  // The backward step: removes effects that a larger set no longer needs. A smaller set that was
  // fitted before may have ended elsewhere; it is fitted again from the larger one's parameters.
  void prune() {
    for (bool changed = candidate_set_.chosen(); changed;) {
      const std::size_t before = found_.best;
      const Hypothesis full = found_.hypotheses[found_.best];
      if (full.effects.size() < 2 || full.fit == pruned_ || !candidate_set_.goes_on()) return;
      pruned_ = full.fit;
      std::vector<std::size_t> made;
      keep_without(full, made);
      candidate_set_.choose();
      changed = found_.best != before;
    }
  }

  Selection& found_;
  const std::vector<RunDatum>& data_;
  const std::vector<Candidate>& all_;
  const SelectionOptions& options_;
  const std::function<void(double)>& progress_;
  Refits refits_;
  CandidateSet candidate_set_;
  std::shared_ptr<const HarmonicFit> pruned_;  // of the hypothesis that was pruned last
};

}  // namespace

Selection judge(HarmonicFit base, const std::vector<RunDatum>& data,
                const std::vector<Candidate>& candidates, const SelectionOptions& options) {
  Selection found;
  found.base.fit = std::make_shared<const HarmonicFit>(std::move(base));
  found.by_gap = options.by_gap;
  Search(found, data, candidates, options, {}).judge_base();
  return found;
}

Selection select_effects(HarmonicFit base, const std::vector<RunDatum>& data,
                         const std::vector<Candidate>& candidates, const SelectionOptions& options,
                         const std::function<void(double)>& progress) {
  Selection found = judge(std::move(base), data, candidates, options);
  progress(0.2);
  if (!found.adequate || options.by_gap) Search(found, data, candidates, options, progress).run();
  return found;
}

}  // namespace shaker::estimator::diagnosis
