#include "estimator/diagnosis/select/internal/pairs.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "estimator/diagnosis/select/internal/families.hpp"
#include "estimator/diagnosis/select/internal/nesting.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kLeastOwn = 1e-3;  // of a direction, beside the other: less is the same effect

bool admissible(const Signature& signature, double value) {
  return signature.sign == 0 || value * signature.sign > 0.0;
}

// What a richer effect does beside its special case is no matter of pairs.
bool may_pair(const Scoring& scoring, std::size_t k) {
  return scoring.design.signatures[k].visible > 0.0 &&
         simpler_than(scoring.scores[k].candidate->name()).empty();
}

// A load path has one part in series.
bool share_the_load_path(const Scoring& scoring, std::size_t i, std::size_t k) {
  const auto in_series = [&](std::size_t of) {
    const Effect* effect = scoring.scores[of].candidate->effect;
    return effect != nullptr && effect->in_series();
  };
  return in_series(i) && in_series(k);
}

std::string kind_or_name(const std::string& effect) {
  const EffectKind* kind = kind_of(effect);
  return kind != nullptr ? std::string(kind->name) : effect;
}

}  // namespace

std::vector<PairScore> joint_scores(const Scoring& scoring, double chance) {
  std::vector<double> along;
  for (const Signature& signature : scoring.design.signatures)
    along.push_back(signature.visible > 0.0 ? signature.direction.dot(scoring.residual) : 0.0);
  std::map<std::pair<std::string, std::string>, PairScore> best;
  for (std::size_t i = 0; i < scoring.scores.size(); ++i) {
    const Signature& a = scoring.design.signatures[i];
    if (!may_pair(scoring, i)) continue;
    for (std::size_t k = i + 1; k < scoring.scores.size(); ++k) {
      const Signature& b = scoring.design.signatures[k];
      const std::string& one = scoring.scores[i].candidate->name();
      const std::string& other = scoring.scores[k].candidate->name();
      if (one == other || !may_pair(scoring, k) || share_the_load_path(scoring, i, k)) continue;
      const double alike = a.direction.dot(b.direction), own = 1.0 - alike * alike;
      if (own < kLeastOwn) continue;
      const double of_a = (along[i] - alike * along[k]) / own;
      const double of_b = (along[k] - alike * along[i]) / own;
      if (!admissible(a, of_a) || !admissible(b, of_b)) continue;
      const double gain = of_a * along[i] + of_b * along[k];
      const double gain_a = scoring.scores[i].gain, gain_b = scoring.scores[k].gain;
      if (!(gain > std::max(gain_a, gain_b) + chance)) continue;
      PairScore& known = best[std::minmax(kind_or_name(one), kind_or_name(other))];
      if (gain > known.gain)
        known = gain_a < gain_b ? PairScore{k, i, gain} : PairScore{i, k, gain};
    }
  }
  std::vector<PairScore> pairs;
  for (const auto& [kinds, pair] : best)
    pairs.push_back(pair);
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const PairScore& a, const PairScore& b) { return a.gain > b.gain; });
  return pairs;
}

}  // namespace shaker::estimator::diagnosis
