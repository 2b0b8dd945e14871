#include "estimator/discrepancy/answer/shares.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/discrepancy/name/nesting.hpp"

namespace shaker::estimator::discrepancy {
namespace {

constexpr double kWorthNaming = 0.005;    // of probability
constexpr double kIndependent = 4.0;      // numbers in a run's model error: its parts hang together
constexpr double kShareOfRecord = 0.125;  // of a record's

// Probability that something else is missing, given the probability p that noise alone makes what
// is left: the largest evidence against noise is 1 / (-e p log p) (Sellke, Bayarri and Berger,
// The American Statistician 55 (2001) 62-71).
double unknown_share(double p) {
  constexpr double kBefore = 0.02;  // of the unknown, before the data
  const double noise =
      p < std::exp(-1.0) ? -std::exp(1.0) * p * std::log(std::max(p, 1e-300)) : 1.0;
  return kBefore / (kBefore + (1.0 - kBefore) * noise);
}

}  // namespace

std::vector<double> shares(const Naming& found, const std::vector<RunDatum>& data,
                           const Selection& selection) {
  double most = 1.0;
  std::vector<double> share;
  double scale = 1.0;
  const Hypothesis* best = selection.chosen();
  if (found.explained) {
    most = 1.0 - unknown_share(found.probability_best);
  } else if (!found.adequate && best != nullptr) {
    const double freedom =
        found.base.fit->observations - static_cast<double>(best->fit->free.size());
    scale = std::max(1.0, best->fit->chi_squared / std::max(1.0, freedom));
    most = std::clamp(1.0 - selection.left_of(*best, found.base), 0.0, kMostUnexplained);
  }
  if (found.by_gap) {
    double independent = 0.0;
    for (const RunDatum& datum : data) {
      if (datum.role != Role::fit) continue;
      independent += datum.sampled ? kShareOfRecord * static_cast<double>(datum.response.size())
                                   : kIndependent;
    }
    scale = std::max(scale, found.base.fit->observations / independent);
  }
  const auto evidence = [&](const Hypothesis& h) { return h.log_evidence / scale; };
  // What is richer than the chosen one has been set aside for it; it stays among its rivals.
  const auto weighs = [&](const Hypothesis& h) {
    const bool richer = best != nullptr && (h.effects.size() > best->effects.size() ||
                                            h.fit->free.size() > best->fit->free.size());
    return counts(h) && !(found.by_gap && richer);
  };
  double largest = evidence(found.base);
  for (const Hypothesis& h : found.hypotheses) {
    if (weighs(h)) largest = std::max(largest, evidence(h));
  }
  double sum = std::exp(evidence(found.base) - largest);
  for (const Hypothesis& h : found.hypotheses)
    sum += weighs(h) ? std::exp(evidence(h) - largest) : 0.0;
  for (const Hypothesis& h : found.hypotheses)
    share.push_back(weighs(h) ? most * std::exp(evidence(h) - largest) / sum : 0.0);
  return share;
}

std::vector<double> agreed_shares(const Naming& found, const std::vector<RunDatum>& data,
                                  Selection& selection) {
  std::vector<double> share;
  const auto probability = [&](const std::string& effect) {
    return probability_of(effect, found, share);
  };
  do {
    share = shares(found, data, selection);
  } while (selection.drop_unlikely(probability, kWorthNaming));
  return share;
}

double probability_of(const std::string& effect, const Naming& found,
                      const std::vector<double>& shares) {
  double sum = 0.0;
  for (std::size_t h = 0; h < found.hypotheses.size(); ++h) {
    // A richer effect that this fit reduces to the simpler one speaks for that.
    const auto& set = found.hypotheses[h].effects;
    const bool holds = std::any_of(set.begin(), set.end(), [&](const std::string& e) {
      return e == effect || (simpler_than(e) == effect && reduces(*found.hypotheses[h].fit, e));
    });
    if (holds) sum += shares[h];
  }
  return sum;
}

}  // namespace shaker::estimator::discrepancy
