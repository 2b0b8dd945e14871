#include "estimator/diagnosis/select/candidate_set.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/noise/residual.hpp"
#include "estimator/diagnosis/select/nesting.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kMinReplacementGain = 5.0;   // of chi-squared: less is chance
constexpr double kMaxSharpenedRatio = 400.0;  // of chi-squared, times the best one's
constexpr double kMaxImprovedRatio =
    4.0;                              // the same, of one that sharper corners do not bring nearer
constexpr double kOtherValley = 2.0;  // of chi-squared, times that of what holds it
constexpr std::size_t kMostRivals = 4;
constexpr double kNoChance = 100.0;  // of chi-squared a datum: draws say 0 to the last digit
// Of log evidence that a simpler effect may be behind the richer one: with the richer one's
// interval holding the special case, and without.
constexpr double kReducedBehind = 10.0, kSimplerBehind = 1.0;

bool without_chance(double chi_squared, std::ptrdiff_t observations) {
  return chi_squared > kNoChance * static_cast<double>(observations);
}

// The same effects, with the simpler one in the place of the one that holds it.
std::vector<std::string> simplified(std::vector<std::string> effects, const std::string& effect) {
  std::replace(effects.begin(), effects.end(), effect, std::string(simpler_than(effect)));
  std::sort(effects.begin(), effects.end());
  return effects;
}

}  // namespace

void CandidateSet::choose() {
  const std::shared_ptr<const HarmonicFit> before =
      chosen_ ? found_.hypotheses[found_.best].fit : nullptr;
  if (!any_best()) return;
  sharpen_rivals();
  any_best();
  try_simpler_rivals();
  for (int round = 0; round < 4 && any_best(); ++round) {
    Hypothesis& best = found_.hypotheses[found_.best];
    const bool centred = refits_.recentred(best);
    if (!refits_.sharpened(best) && !centred) break;
  }
  any_best();
  prefer_simpler();
  chosen_ = true;
  if (before != found_.hypotheses[found_.best].fit) judge_best();
}

// The test looks at all data together, in units of the noise; what is left in the response's own
// unit is looked at too.
void CandidateSet::judge_best() {
  const Hypothesis& best = found_.hypotheses[found_.best];
  found_.probability_best = 0.0;
  found_.explained = small_gap_ = false;
  // Nobody asks how probable shares of a gap are, nor the catalogue where there is no chance.
  if (options_.simple_first || without_chance(best.fit->chi_squared, best.fit->observations))
    return;
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

// Where the best would gain by sharper corners, so might those close behind: a rounded corner
// must not decide between them.
void CandidateSet::sharpen_rivals() {
  const Hypothesis& best = found_.hypotheses[found_.best];
  const double limit = kMaxSharpenedRatio * best.fit->chi_squared;
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
    const double best_left = found_.hypotheses[found_.best].fit->chi_squared;
    refits_.sharpened(found_.hypotheses[rivals[i]], kMaxImprovedRatio * best_left);
  }
}

// Of those close behind the best the simpler one may be the best. Shares of a gap have no such
// order.
void CandidateSet::try_simpler_rivals() {
  if (options_.simple_first) return;
  const std::vector<Hypothesis> all = found_.hypotheses;  // they may become more
  const double least = found_.hypotheses[found_.best].log_evidence - kReducedBehind;
  for (const Hypothesis& h : all) {
    if (!h.disqualified.empty() || !(h.log_evidence > least)) continue;
    for (const std::string& effect : h.effects)
      try_simpler(h, effect, simplified(h.effects, effect));
  }
}

// Where the richer effect's fit says that the simpler one would do, that is asked of it: the search
// may have passed it by, or left it in another valley.
void CandidateSet::try_simpler(const Hypothesis& best, const std::string& effect,
                               const std::vector<std::string>& wanted) {
  if (!reduces(*best.fit, effect)) return;
  const Hypothesis* known = find(wanted);
  const double near = kOtherValley * rounded(best).chi_squared;
  if (known != nullptr && known->disqualified.empty() && rounded(*known).chi_squared < near) return;
  const auto simpler = std::find_if(all_.begin(), all_.end(), [&](const Candidate& candidate) {
    return candidate.effect->name() == simpler_than(effect);
  });
  if (simpler == all_.end()) return;
  std::vector<std::size_t> made;
  keep(refits_.with_simpler(best, effect, simpler->probes.front().line), made);
}

// A richer effect gives way to the simpler one that it holds where the data do not exclude that.
void CandidateSet::prefer_simpler() {
  for (bool changed = true; changed;) {
    changed = false;
    const Hypothesis best = found_.hypotheses[found_.best];  // they may become more
    for (const std::string& effect : best.effects) {
      const std::vector<std::string> wanted = simplified(best.effects, effect);
      try_simpler(best, effect, wanted);
      Hypothesis* simpler = find(wanted);
      if (simpler == nullptr || !simpler->disqualified.empty()) continue;
      refits_.sharpened(*simpler);
      if (!simpler->disqualified.empty()) continue;
      const double behind = best.log_evidence - simpler->log_evidence;
      if (behind > (reduces(*best.fit, effect) ? kReducedBehind : kSimplerBehind)) continue;
      found_.best = static_cast<std::size_t>(simpler - found_.hypotheses.data());
      changed = true;
      break;
    }
  }
}

// Where shares of the gap are weighed, the errors are what a first search left, and a fit that
// leaves no more than them says nothing.
bool CandidateSet::settled() const {
  return chosen_ && found_.explained && small_gap_ && !options_.simple_first;
}

double CandidateSet::left_by_best() const {
  return chosen_ ? found_.hypotheses[found_.best].fit->chi_squared : found_.base.fit->chi_squared;
}

const Scoring& CandidateSet::scored(const std::shared_ptr<const HarmonicFit>& fit) {
  auto& known = scored_[fit];
  if (!known) known = std::make_shared<const Scoring>(score(*fit, data_, all_, options_.fit));
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

void CandidateSet::sort_by_evidence(std::vector<std::size_t>& level) const {
  std::stable_sort(level.begin(), level.end(), [&](std::size_t a, std::size_t b) {
    return found_.hypotheses[a].log_evidence > found_.hypotheses[b].log_evidence;
  });
}

}  // namespace shaker::estimator::diagnosis
