// The hypotheses that were refitted so far, the best of them, and whether it leaves only noise.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "estimator/diagnosis/select/internal/refits.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

// The arguments of the constructor must outlive the object.
class CandidateSet {
 public:
  CandidateSet(Selection& found, const std::vector<RunDatum>& data,
               const std::vector<Candidate>& all, const SelectionOptions& options,
               const Refits& refits)
      : found_(found), data_(data), all_(all), options_(options), refits_(refits) {}

  // Finds the best admissible hypothesis, with smoothing widths as narrow as the comparison needs.
  void choose();
  // True if choose() has found one.
  bool chosen() const { return chosen_; }
  // True if the search can end: the best hypothesis leaves only noise, and a gap that counts as
  // explained.
  bool settled() const;
  // False when this search has used its share of the budget. The selection is then marked as cut
  // short.
  bool goes_on();
  double left_by_best() const;  // in chi-squared

  // Scores the catalogue on a fit, once for each fit: judging the best hypothesis and extending it
  // use the same scores.
  const Scoring& scored(const std::shared_ptr<const HarmonicFit>& fit);
  // The same for a hypothesis: signatures from the fit with wide smoothing, residual from the
  // narrow one.
  Scoring scored(const Hypothesis& h);
  double probability(const Scoring& scoring) const;  // that noise alone makes it

  Hypothesis* find(const std::vector<std::string>& effects);
  // Adds a hypothesis, or replaces a known one with the same effects that is worse. `made` receives
  // the indices of new ones.
  void keep(Hypothesis h, std::vector<std::size_t>& made);
  void sort_by_evidence(std::vector<std::size_t>& level) const;

 private:
  bool any_best();
  void narrow_rivals();
  void prefer_simpler();
  bool gives_way(const Hypothesis& best, const std::string& effect, const std::string& special);
  void try_simpler(const Hypothesis& best, const std::string& effect, const std::string& special);
  void judge_best();

  Selection& found_;
  const std::vector<RunDatum>& data_;
  const std::vector<Candidate>& all_;
  const SelectionOptions& options_;
  const Refits& refits_;
  std::map<std::shared_ptr<const HarmonicFit>, std::shared_ptr<const Scoring>> scored_;
  bool chosen_ = false;
  bool small_gap_ = false;
};

}  // namespace shaker::estimator::diagnosis
