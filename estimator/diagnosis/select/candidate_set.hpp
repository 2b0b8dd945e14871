// The hypotheses refitted so far, which of them is the best, and whether it leaves but noise.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "estimator/diagnosis/select/refits.hpp"
#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

// Its arguments must outlive it.
class CandidateSet {
 public:
  CandidateSet(Selection& found, const std::vector<RunDatum>& data,
               const std::vector<Candidate>& all, const SelectionOptions& options,
               const Refits& refits)
      : found_(found), data_(data), all_(all), options_(options), refits_(refits) {}

  // Finds the best admissible hypothesis of all, with corners as sharp as it needs.
  void choose();
  // There is one.
  bool chosen() const { return chosen_; }
  // The search is over: the best leaves but noise, and no more of a gap than is called explained.
  bool settled() const;
  // Not once this search has had its part of the budget: then it counts as cut short.
  bool goes_on();
  double left_by_best() const;  // in chi-squared

  // The score of the catalogue on a fit; each fit once: that the best is judged by is what it is
  // extended by.
  const Scoring& scored(const std::shared_ptr<const HarmonicFit>& fit);
  // Of its round corners the design, of the sharp ones what is left.
  Scoring scored(const Hypothesis& h);
  double probability(const Scoring& scoring) const;  // that noise alone makes it

  Hypothesis* find(const std::vector<std::string>& effects);
  // Takes it in, or in the place of a known one that it is better than. `made`: those that are new.
  void keep(Hypothesis h, std::vector<std::size_t>& made);
  void sort_by_evidence(std::vector<std::size_t>& level) const;

 private:
  bool any_best();
  void sharpen_rivals();
  void try_simpler_rivals();
  void prefer_simpler();
  void try_simpler(const Hypothesis& best, const std::string& effect,
                   const std::vector<std::string>& wanted);
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
