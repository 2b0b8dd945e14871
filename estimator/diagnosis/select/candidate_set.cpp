#include "estimator/diagnosis/select/internal/candidate_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/diagnosis/noise/internal/residual.hpp"
#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "estimator/diagnosis/select/internal/weights.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kMinReplacementGain = 5.0;  // of chi-squared: less is chance
constexpr double kMaxNarrowedRatio = 400.0;  // of chi-squared, times the best one's
constexpr double kMaxImprovedRatio =
    4.0;                              // the same, of one that sharper corners do not bring nearer
constexpr double kOtherValley = 2.0;  // of chi-squared, times that of what holds it
constexpr std::size_t kMostRivals = 4;
constexpr double kNearNoise = 4.0;   // of chi-squared a datum, left by the best
constexpr double kNoChance = 100.0;  // of chi-squared a datum: draws say 0 to the last digit
// Log evidence by which a simpler effect may be worse than a richer one: if the interval of the
// richer one includes the special case, and otherwise (odds of one in ten, as of one effect more).
constexpr double kReducedBehind = 10.0, kSimplerBehind = 2.3;

bool without_chance(double chi_squared, std::ptrdiff_t observations) {
  return chi_squared > kNoChance * static_cast<double>(observations);
}

// True if one set is the other with a richer effect replaced by its special case.
bool special_case(const Hypothesis& simpler, const Hypothesis& richer) {
  return std::any_of(richer.effects.begin(), richer.effects.end(), [&](const std::string& effect) {
    const auto special = simpler_than(effect);
    return std::any_of(special.begin(), special.end(), [&](const std::string& other) {
      return with_instead(richer.effects, effect, other) == simpler.effects;
    });
  });
}

}  // namespace

void CandidateSet::choose() {
  const std::shared_ptr<const HarmonicFit> before =
      chosen_ ? found_.hypotheses[found_.best].fit : nullptr;
  if (!any_best()) return;
  narrow_rivals();
  any_best();
  for (int round = 0; round < 4 && any_best(); ++round) {
    Hypothesis& best = found_.hypotheses[found_.best];
    if (!refits_.narrowed(best)) break;
  }
  any_best();
  prefer_simpler();
  chosen_ = true;
  if (before != found_.hypotheses[found_.best].fit) judge_best();
}

// The test judges all data together, in units of the noise. The gap in the unit of the response
// must be small too.
void CandidateSet::judge_best() {
  const Hypothesis& best = found_.hypotheses[found_.best];
  found_.probability_best = 0.0;
  found_.explained = small_gap_ = false;
  // The probability is not needed in a search by shares of the gap, nor the scores if chance is
  // excluded.
  if (options_.by_gap || without_chance(best.fit->chi_squared, best.fit->observations)) return;
  found_.probability_best = probability(scored(best));
  found_.explained = found_.probability_best > options_.false_alarm_rate;
  small_gap_ = found_.explained &&
               gap_over_floor({*best.fit, best.data ? *best.data : data_}, data_) <= kExplainedGap;
}

bool CandidateSet::goes_on() {
  const auto& budget = data_.front().budget;
  if (budget && budget->leaves_less_than(options_.leave)) found_.cut_short = true;
  return !found_.cut_short;
}

bool CandidateSet::any_best() {
  bool any = false;
  for (std::size_t h = 0; h < found_.hypotheses.size(); ++h) {
    const Hypothesis& now = found_.hypotheses[h];
    if (!now.disqualified.empty() || !std::isfinite(now.fit->chi_squared)) continue;
    if (!any || now.log_evidence > found_.hypotheses[found_.best].log_evidence) found_.best = h;
    any = true;
  }
  return any;
}

// If narrower smoothing improves the best hypothesis, it may improve those close behind it too. The
// smoothing width must not decide between them.
void CandidateSet::narrow_rivals() {
  const Hypothesis& best = found_.hypotheses[found_.best];
  const double limit = kMaxNarrowedRatio * best.fit->chi_squared;
  const std::size_t size = best.effects.size();
  std::vector<std::size_t> rivals;
  for (std::size_t h = 0; h < found_.hypotheses.size(); ++h) {
    const Hypothesis& now = found_.hypotheses[h];
    if (now.disqualified.empty() && !now.rounded && now.effects.size() <= size &&
        now.fit->chi_squared < limit)
      rivals.push_back(h);
  }
  sort_by_evidence(rivals);
  for (std::size_t i = 0; i < rivals.size() && i < kMostRivals; ++i) {
    if (!goes_on()) return;
    any_best();  // the last one may be it, or was and is disqualified
    const Hypothesis& now_best = found_.hypotheses[found_.best];
    Hypothesis& rival = found_.hypotheses[rivals[i]];
    // A richer effect may imitate a corner that is sharper than the grid. Its special case is
    // therefore always taken to the limit.
    const double hopeless = special_case(rival, now_best)
                                ? std::numeric_limits<double>::infinity()
                                : kMaxImprovedRatio * now_best.fit->chi_squared;
    refits_.narrowed(rival, hopeless);
  }
}

// If the fit of a richer effect allows its special case, that is fitted too: the search may not
// have tried it, or may have left it in another valley.
void CandidateSet::try_simpler(const Hypothesis& best, const std::string& effect,
                               const std::string& special) {
  if (!reduces(*best.fit, effect, special)) return;
  const Hypothesis* known = find(with_instead(best.effects, effect, special));
  const double near = kOtherValley * rounded(best).chi_squared;
  if (known != nullptr && known->disqualified.empty() && rounded(*known).chi_squared < near) return;
  const auto simpler = std::find_if(all_.begin(), all_.end(), [&](const Candidate& candidate) {
    return candidate.name() == special;
  });
  if (simpler == all_.end()) return;
  std::vector<std::size_t> made;
  keep(refits_.with_instead(best, effect, simpler->probes.front().line), made);
}

// A richer effect gives way to its special case if the data do not exclude that.
void CandidateSet::prefer_simpler() {
  for (bool changed = true; changed;) {
    changed = false;
    const Hypothesis best = found_.hypotheses[found_.best];  // they may become more
    for (const std::string& effect : best.effects) {
      for (const std::string& special : simpler_than(effect)) {
        if (!changed && gives_way(best, effect, special)) changed = true;
      }
      if (changed) break;
    }
  }
}

// Makes the special case the best one if the data do not exclude it.
bool CandidateSet::gives_way(const Hypothesis& best, const std::string& effect,
                             const std::string& special) {
  try_simpler(best, effect, special);
  Hypothesis* simpler = find(with_instead(best.effects, effect, special));
  if (simpler == nullptr || !simpler->disqualified.empty()) return false;
  refits_.narrowed(*simpler);
  if (!simpler->disqualified.empty()) return false;
  const double behind = best.log_evidence - simpler->log_evidence;
  if (behind > (reduces(*best.fit, effect, special) ? kReducedBehind : kSimplerBehind))
    return false;
  found_.best = static_cast<std::size_t>(simpler - found_.hypotheses.data());
  return true;
}

// In a search by shares of the gap the errors come from the residual of a first search. A fit that
// leaves no more than these errors therefore proves nothing.
bool CandidateSet::settled() const {
  return chosen_ && found_.explained && small_gap_ && !options_.by_gap;
}

double CandidateSet::left_by_best() const {
  return chosen_ ? found_.hypotheses[found_.best].fit->chi_squared : found_.base.fit->chi_squared;
}

const Scoring& CandidateSet::scored(const std::shared_ptr<const HarmonicFit>& fit) {
  auto& known = scored_[fit];
  if (!known)
    known = std::make_shared<const Scoring>(
        score(*fit, data_, all_, options_.fit, &found_.base_scoring));
  return *known;
}

Scoring CandidateSet::scored(const Hypothesis& h) {
  Scoring scoring = scored(h.rounded ? h.rounded : h.fit);
  if (!h.rounded) return scoring;
  const Projector project(scoring.design.jacobian);
  scoring.residual = project(stacked_residual(*h.fit, *h.data));
  scoring.chi_squared = h.fit->chi_squared;
  for (std::size_t k = 0; k < scoring.scores.size(); ++k) {
    const Signature& signature = scoring.design.signatures[k];
    scoring.scores[k].gain = signature.visible > 0.0 ? gain_of(signature, scoring.residual) : 0.0;
  }
  return scoring;
}

double CandidateSet::probability(const Scoring& scoring) const {
  if (without_chance(scoring.chi_squared, scoring.residual.size())) return 0.0;
  if (options_.calibrations != nullptr)
    return options_.calibrations->get(scoring.design, options_.draws, options_.seed)
        ->combined(scoring.chi_squared, scoring.best_gain());
  const Calibration calibration(scoring.design, options_.draws, options_.seed);
  return calibration.combined(scoring.chi_squared, scoring.best_gain());
}

Hypothesis* CandidateSet::find(const std::vector<std::string>& effects) {
  const auto known = std::find_if(found_.hypotheses.begin(), found_.hypotheses.end(),
                                  [&](const Hypothesis& h) { return h.effects == effects; });
  return known == found_.hypotheses.end() ? nullptr : &*known;
}

void CandidateSet::keep(Hypothesis h, std::vector<std::size_t>& made) {
  if (!std::isfinite(h.fit->chi_squared)) return;
  Hypothesis* known = find(h.effects);
  if (known == nullptr) {
    made.push_back(found_.hypotheses.size());
    found_.hypotheses.push_back(std::move(h));
    return;
  }
  const bool mends = h.disqualified.empty() && !known->disqualified.empty();
  if (h.fit->chi_squared < rounded(*known).chi_squared - kMinReplacementGain || mends)
    *known = std::move(h);
}

// Student's t forgives a few large residuals. Where all are large, its evidence may prefer a fit that
// leaves more than the base model does.
void CandidateSet::sort_by_evidence(std::vector<std::size_t>& level) const {
  const Weights weights(found_, data_);
  const bool far = found_.by_gap || left_by_best() > kNearNoise * found_.base.fit->observations;
  const auto weight = [&](std::size_t k) {
    const Hypothesis& h = found_.hypotheses[k];
    return far ? weights.log_of(h) : h.log_evidence;
  };
  std::stable_sort(level.begin(), level.end(),
                   [&](std::size_t a, std::size_t b) { return weight(a) > weight(b); });
}

}  // namespace shaker::estimator::diagnosis
