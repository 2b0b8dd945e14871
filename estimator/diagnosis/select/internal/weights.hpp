// How much a hypothesis weighs against the others: one measure for the search, the answer, the
// names' probabilities and the sets of names that cannot be told apart.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

// True if a hypothesis can be the answer.
bool counts(const Hypothesis& h);

// A set of effects has beforehand what it takes that so many are missing at once, spread over all
// such sets of the catalogue: a second name must be better than the best of so many. Where the best
// leaves only noise, a set weighs its evidence too. Otherwise the size of what the unknown makes is
// not known. It is integrated out: with m independent numbers in what is left, the likelihood is
// chi-squared to the power -m/2, and each parameter costs half a log(m).
class Weights {
 public:
  // Of what is in `found` so far; the object must outlive this one.
  Weights(const Selection& found, const std::vector<RunDatum>& data);

  double log_of(const Hypothesis& h) const;
  // Of all sets of effects together; minus infinity where there is none.
  double log_of_effects() const;
  // Of nothing that is missing while the runs differ in their constants: beforehand as likely as that
  // some effect of the catalogue is missing. `log_evidence`: of the base model with such runs.
  double log_of_runs_that_differ(double log_evidence) const;
  // The one that weighs most, of those with at most `most` effects for which `may` holds; null: the
  // base model, or none.
  template <typename May>
  const Hypothesis* heaviest(std::size_t most, const May& may) const {
    const Hypothesis* best = nullptr;
    double weight = log_of(found_.base);
    for (const Hypothesis& h : found_.hypotheses) {
      if (!counts(h) || h.effects.size() > most || !may(h) || !(log_of(h) > weight)) continue;
      best = &h;
      weight = log_of(h);
    }
    return best;
  }

 private:
  double log_before(std::size_t effects) const;

  const Selection& found_;
  std::size_t catalogue_ = 0;
  bool only_noise_ = false;
  double numbers_ = 0.0;  // independent ones, in what the best leaves
};

}  // namespace shaker::estimator::diagnosis
