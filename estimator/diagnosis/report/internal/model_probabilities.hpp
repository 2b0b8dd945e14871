// How sure a name is: shares of the probability among everything that was refitted, nothing, and
// the unknown.
//
// What each hypothesis weighs says weights.hpp. Where the best leaves nothing but noise, the unknown
// has what the test of that leaves it. Otherwise the unknown is there, and two things may be so: the
// named effect is there beside it, or the unknown alone makes the gap and the named effect imitates
// a part of it. The second is as likely as so much of a gap is closed by chance.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/report/internal/choice.hpp"

namespace shaker::estimator::diagnosis {

// Of a name, while something is left.
inline constexpr double kMostUnexplained = 0.9;

// The selection, once all effects of what is chosen are worth a name by the evidence alone: the
// improved model and the names agree.
const Choice& agree(const Selection& found, const std::vector<RunDatum>& data, Choice& choice);

// What is the answer then, of found.hypotheses; nothing where there is none.
std::optional<std::size_t> answer_of(const Selection& found, const std::vector<RunDatum>& data);

// That the best of the catalogue, one after another, closes all but the share `left` of a gap's
// square that an unknown effect makes: the share that each of them leaves of it is any number
// between 0 and 1 alike.
double chance_to_imitate(double left, int effects);

// That the named effects stand beside the unknown one, and do not imitate it.
double chance_beside_unknown(double left, int effects);

// Of what the selection has agreed on. Its arguments must outlive it.
class ModelProbabilities {
 public:
  ModelProbabilities(const Selection& found, const std::vector<RunDatum>& data,
                     const Choice& choice);

  // Of all hypotheses that hold the effect.
  double probability_of(const std::string& effect) const;
  // Of all that hold any of them: several of one kind in one hypothesis close the gap together, as
  // one does.
  double probability_of_any(const std::vector<std::string>& effects) const;
  // Of found.hypotheses[k], and of the base model; together 1, whatever the unknown has.
  double of(std::size_t k) const { return weight_[k]; }
  double of_base() const;
  // That found.hypotheses[k] only imitates an unknown effect, if it is what is taken.
  double imitates(std::size_t k) const;
  // That something unknown is there too.
  double of_unknown() const { return unknown_; }

 private:
  const Selection& found_;
  const Choice& choice_;
  std::vector<double> weight_;  // of each hypothesis
  double unknown_ = 0.0;        // that something unknown is there too
};

}  // namespace shaker::estimator::diagnosis
