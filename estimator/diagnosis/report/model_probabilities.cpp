#include "estimator/diagnosis/report/model_probabilities.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "estimator/diagnosis/select/nesting.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kMinNamedProbability = 0.005;  // of probability
constexpr double kUnknown = 0.02;               // that there is something unknown, before the data
// That the unknown stands beside a named effect, over that the effect only imitates it. Dampers
// that lack several things have the unknown beside the effects as a rule (docs/dirty_suite.md).
constexpr double kUnknownBeside = 0.2;
constexpr double kIndependent = 4.0;      // numbers in a run's model error: its parts hang together
constexpr double kShareOfRecord = 0.125;  // of a record's

// Probability that something else is missing, given the probability p that noise alone makes what
// is left: the largest evidence against noise is 1 / (-e p log p) (Sellke, Bayarri and Berger,
// The American Statistician 55 (2001) 62-71).
double unknown_share(double p) {
  const double noise =
      p < std::exp(-1.0) ? -std::exp(1.0) * p * std::log(std::max(p, 1e-300)) : 1.0;
  return kUnknown / (kUnknown + (1.0 - kUnknown) * noise);
}

// Log of what a set of so many effects has beforehand, over what one effect has: few campaigns lack
// two, and of the pairs there are many more.
double log_before(std::size_t effects, std::size_t catalogue) {
  constexpr double kOneMore = 0.1;  // that one more is missing
  double sum = 0.0;
  for (std::size_t k = 1; k < effects; ++k) {
    const double others = catalogue > k ? static_cast<double>(catalogue - k) : 1.0;
    sum += std::log(kOneMore * static_cast<double>(k + 1) / others);
  }
  return sum;
}

std::size_t size_of_catalogue(const Selection& found) {
  std::set<const Candidate*> all;
  for (const Score& score : found.base_scoring.scores)
    all.insert(score.candidate);
  return all.size();
}

// What the evidence of all is divided by.
double scale_of(const Selection& found, const std::vector<RunDatum>& data, const Hypothesis* best) {
  double scale = 1.0;
  if (!found.explained && !found.adequate && best != nullptr) {
    const double freedom =
        found.base.fit->observations - static_cast<double>(best->fit->free.size());
    scale = std::max(1.0, best->fit->chi_squared / std::max(1.0, freedom));
  }
  if (!found.by_gap) return scale;
  double independent = 0.0;
  for (const RunDatum& datum : data) {
    if (datum.role != Role::fit) continue;
    independent +=
        datum.sampled ? kShareOfRecord * static_cast<double>(datum.response.size()) : kIndependent;
  }
  return std::max(scale, found.base.fit->observations / independent);
}

// Of each hypothesis.
std::vector<double> weights(const Selection& found, const std::vector<RunDatum>& data,
                            const Choice& choice) {
  const Hypothesis* best = choice.chosen();
  const double scale = scale_of(found, data, best);
  const std::size_t catalogue = size_of_catalogue(found);
  const auto log_weight = [&](const Hypothesis& h) {
    return h.log_evidence / scale + log_before(h.effects.size(), catalogue);
  };
  // Beside a gap, what has more effects than the chosen one has been set aside for it; by shares of
  // the gap, what has more parameters too.
  const auto richer = [&](const Hypothesis& h) {
    return best != nullptr && !found.explained &&
           (h.effects.size() > best->effects.size() ||
            (found.by_gap && h.fit->free.size() > best->fit->free.size()));
  };
  const auto weighs = [&](const Hypothesis& h) { return counts(h) && !richer(h); };
  double largest = log_weight(found.base);
  for (const Hypothesis& h : found.hypotheses) {
    if (weighs(h)) largest = std::max(largest, log_weight(h));
  }
  std::vector<double> weight;
  double sum = std::exp(log_weight(found.base) - largest);
  for (const Hypothesis& h : found.hypotheses) {
    weight.push_back(weighs(h) ? std::exp(log_weight(h) - largest) : 0.0);
    sum += weight.back();
  }
  for (double& w : weight)
    w /= sum;
  return weight;
}

// A richer effect that this fit reduces to the simpler one speaks for that.
bool speaks_for(const Hypothesis& h, const std::string& effect) {
  return std::any_of(h.effects.begin(), h.effects.end(), [&](const std::string& e) {
    return e == effect || (simpler_than(e) == effect && reduces(*h.fit, e));
  });
}

// How many of the effects a fit speaks for.
int spoken_for(const Hypothesis& h, const std::vector<std::string>& effects) {
  return static_cast<int>(
      std::count_if(effects.begin(), effects.end(),
                    [&](const std::string& effect) { return speaks_for(h, effect); }));
}

// That what effects of one kind close in `h` is their own, where something is left that is not
// noise.
double own_part(const Hypothesis& h, const std::vector<std::string>& effects,
                const Selection& found, const Choice& choice) {
  const Hypothesis* without = &found.base;
  for (const Hypothesis* step : choice.path()) {
    if (spoken_for(*step, effects) > 0) break;
    if (std::includes(h.effects.begin(), h.effects.end(), step->effects.begin(),
                      step->effects.end()))
      without = step;
  }
  const double left = std::min(1.0, choice.left_of(h, *without));
  const auto added = static_cast<int>(h.effects.size() - without->effects.size());
  const int steps = added - std::max(0, std::min(spoken_for(h, effects), added) - 1);
  return chance_beside_unknown(left, steps);
}

}  // namespace

double chance_beside_unknown(double left, int effects) {
  return kUnknownBeside / (kUnknownBeside + chance_to_imitate(left, effects));
}

double chance_to_imitate(double left, int effects) {
  if (left <= 0.0) return 0.0;
  const double depth = -std::log(std::min(1.0, left));
  double term = std::exp(-depth), sum = 0.0;
  for (int k = 1; k <= std::max(1, effects); ++k) {
    sum += term;
    term *= depth / k;
  }
  return std::min(1.0, sum);
}

const Choice& agree(const Selection& found, const std::vector<RunDatum>& data, Choice& choice) {
  bool dropped = true;
  while (dropped) {
    const ModelProbabilities now(found, data, choice);
    dropped =
        choice.drop_unlikely([&](const std::string& effect) { return now.probability_of(effect); },
                             kMinNamedProbability);
  }
  return choice;
}

std::optional<std::size_t> answer_of(const Selection& found, const std::vector<RunDatum>& data) {
  Choice choice(found, data);
  const Hypothesis* chosen = agree(found, data, choice).chosen();
  if (chosen == nullptr) return std::nullopt;
  return static_cast<std::size_t>(chosen - found.hypotheses.data());
}

ModelProbabilities::ModelProbabilities(const Selection& found, const std::vector<RunDatum>& data,
                                       const Choice& choice)
    : found_(found), choice_(choice) {
  weight_ = weights(found, data, choice);
  unknown_ = found.adequate ? 0.0 : unknown_share(found.probability_best);
}

double ModelProbabilities::of_base() const {
  double others = 0.0;
  for (const double w : weight_)
    others += w;
  return std::max(0.0, 1.0 - others);
}

double ModelProbabilities::imitates(std::size_t k) const {
  const Hypothesis& h = found_.hypotheses[k];
  if (found_.explained || found_.adequate || !counts(h)) return 0.0;
  const double left = std::min(1.0, choice_.left_of(h, found_.base));
  const double chance = chance_to_imitate(left, static_cast<int>(h.effects.size()));
  return unknown_ * chance / (kUnknownBeside + chance);
}

double ModelProbabilities::probability_of(const std::string& effect) const {
  return probability_of_any({effect});
}

double ModelProbabilities::probability_of_any(const std::vector<std::string>& effects) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < weight_.size(); ++k) {
    const Hypothesis& h = found_.hypotheses[k];
    if (weight_[k] == 0.0 || spoken_for(h, effects) == 0) continue;
    const double beside_unknown =
        found_.explained || found_.adequate ? 0.0 : own_part(h, effects, found_, choice_);
    sum += weight_[k] * (1.0 - unknown_ * (1.0 - beside_unknown));
  }
  return found_.explained || found_.adequate ? sum : std::min(sum, kMostUnexplained);
}

}  // namespace shaker::estimator::diagnosis
