#include "estimator/diagnosis/report/internal/indistinguishable_set.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kInTheSet = 4.0;      // of log weight behind the best: cannot be excluded
constexpr double kGainInTheSet = 8.0;  // of chi-squared behind, for those that were not refitted

}  // namespace

std::vector<std::string> indistinguishable_set(const std::string& effect, const Selection& found,
                                               const Hypothesis& best, const Weights& weights) {
  std::vector<std::string> others;
  for (const std::string& e : best.effects) {
    if (e != effect) others.push_back(e);
  }
  std::vector<std::string> set;
  for (const Hypothesis& h : found.hypotheses) {
    if (!h.disqualified.empty() || h.effects.size() != best.effects.size()) continue;
    if (weights.log_of(h) < weights.log_of(best) - kInTheSet) continue;
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
  for (const Score& s : found.base_scoring.scores) {
    if (s.candidate->name() == effect) own = std::max(own, s.gain);
  }
  for (const Score& s : found.base_scoring.scores) {
    const std::string& other = s.candidate->name();
    const bool refitted = std::any_of(
        found.hypotheses.begin(), found.hypotheses.end(),
        [&](const Hypothesis& h) { return h.effects.size() == 1 && h.effects[0] == other; });
    if (refitted || other == effect || s.gain < own - kGainInTheSet) continue;
    if (std::find(set.begin(), set.end(), other) == set.end()) set.push_back(other);
  }
  return set;
}

std::vector<const HarmonicFit*> indistinguishable_fits(const std::string& effect,
                                                       const Selection& found,
                                                       const Hypothesis& best,
                                                       const Weights& weights) {
  std::vector<const HarmonicFit*> fits;
  for (const std::string& rival : indistinguishable_set(effect, found, best, weights)) {
    std::vector<std::string> effects = best.effects;
    std::replace(effects.begin(), effects.end(), effect, rival);
    std::sort(effects.begin(), effects.end());
    for (const Hypothesis& h : found.hypotheses) {
      const bool same = reduces(*h.fit, rival, effect);
      if (h.effects == effects && !same && std::isfinite(h.fit->chi_squared))
        fits.push_back(&rounded(h));
    }
  }
  return fits;
}

}  // namespace shaker::estimator::diagnosis
