#include "estimator/diagnosis/report/internal/model_probabilities.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "estimator/diagnosis/select/internal/weights.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kMinNamedProbability = 0.005;  // of probability
constexpr double kUnknown = 0.02;               // that there is something unknown, before the data
// That the unknown stands beside a named effect, over that the effect only imitates it. Dampers
// that lack several things have the unknown beside the effects as a rule (docs/dirty_suite.md).
constexpr double kUnknownBeside = 0.2;

// Probability that something else is missing, given the probability p that noise alone makes what
// is left: the largest evidence against noise is 1 / (-e p log p) (Sellke, Bayarri and Berger,
// The American Statistician 55 (2001) 62-71).
double unknown_share(double p) {
  const double noise =
      p < std::exp(-1.0) ? -std::exp(1.0) * p * std::log(std::max(p, 1e-300)) : 1.0;
  return kUnknown / (kUnknown + (1.0 - kUnknown) * noise);
}

// Of each hypothesis. Beside a gap, what has more effects than the chosen one has been set aside for
// it.
std::vector<double> weights(const Selection& found, const std::vector<RunDatum>& data,
                            const Choice& choice) {
  const Weights weights(found, data);
  const Hypothesis* best = choice.chosen();
  const auto weighs = [&](const Hypothesis& h) {
    return counts(h) &&
           (best == nullptr || found.explained || h.effects.size() <= best->effects.size());
  };
  double largest = weights.log_of(found.base);
  for (const Hypothesis& h : found.hypotheses) {
    if (weighs(h)) largest = std::max(largest, weights.log_of(h));
  }
  std::vector<double> weight;
  double sum = std::exp(weights.log_of(found.base) - largest);
  for (const Hypothesis& h : found.hypotheses) {
    weight.push_back(weighs(h) ? std::exp(weights.log_of(h) - largest) : 0.0);
    sum += weight.back();
  }
  for (double& w : weight)
    w /= sum;
  return weight;
}

// A richer effect that this fit reduces to the simpler one speaks for that.
bool speaks_for(const Hypothesis& h, const std::string& effect) {
  return std::any_of(h.effects.begin(), h.effects.end(), [&](const std::string& e) {
    return e == effect || reduces(*h.fit, e, effect);
  });
}

// How many of the effects a fit speaks for.
int spoken_for(const Hypothesis& h, const std::vector<std::string>& effects) {
  return static_cast<int>(
      std::count_if(effects.begin(), effects.end(),
                    [&](const std::string& effect) { return speaks_for(h, effect); }));
}

// The part of `h` without those effects that leaves least.
const Hypothesis& rest_of(const Hypothesis& h, const std::vector<std::string>& effects,
                          const Selection& found) {
  const Hypothesis* best = &found.base;
  for (const Hypothesis& part : found.hypotheses) {
    if (counts(part) && part.effects.size() < h.effects.size() && spoken_for(part, effects) == 0 &&
        part.fit->chi_squared < best->fit->chi_squared &&
        std::includes(h.effects.begin(), h.effects.end(), part.effects.begin(), part.effects.end()))
      best = &part;
  }
  return *best;
}

// That what effects of one kind close in `h` is their own, where something is left that is not
// noise.
double own_part(const Hypothesis& h, const std::vector<std::string>& effects,
                const Selection& found, const Choice& choice) {
  const Hypothesis& without = rest_of(h, effects, found);
  const double left = std::min(1.0, choice.left_of(h, without));
  const auto added = static_cast<int>(h.effects.size() - without.effects.size());
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
  if (found_.explained || found_.adequate) return sum;
  double most = std::min(sum, kMostUnexplained);
  // Which part of a hypothesis was fitted without them decides what they close; any of them is
  // there at least as likely as each.
  for (const std::string& effect : effects)
    if (effects.size() > 1) most = std::max(most, probability_of(effect));
  return most;
}

}  // namespace shaker::estimator::diagnosis
