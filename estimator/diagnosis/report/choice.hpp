// Which hypothesis is the answer.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

// Residual of a run in harmonics.
Eigen::VectorXd residual_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                            std::size_t run);

// The arguments of the constructor must outlive the object.
class Choice {
 public:
  Choice(const Selection& found, const std::vector<RunDatum>& data);

  // The best hypothesis. If something unknown is left, the smallest hypothesis for which no larger
  // one halves the residual: a known effect must not compensate an unknown one. Null: none.
  const Hypothesis* chosen() const { return chosen_; }
  // The hypotheses on the way to it, each with one effect more.
  const std::vector<const Hypothesis*>& path() const { return path_; }
  // Share of the squared gap of `other` that `one` leaves, in units of the noise or in the unit of
  // the response: far from the data the noise is a bad measure.
  double left_of(const Hypothesis& one, const Hypothesis& other) const;
  // Chooses again without the effects whose probability is below `least`, until all of them are
  // above it: the remaining effects of the hypothesis, or otherwise the most probable hypothesis
  // with as few effects. Returns false if no effect remains. `probability`: of an effect.
  bool drop_unlikely(const std::function<double(const std::string&)>& probability, double least);

 private:
  void drop_idle();
  void name_simpler();
  const Hypothesis* after(const Hypothesis& smallest) const;
  const std::vector<RunDatum>& data_of(const Hypothesis& h) const;

  const Selection& found_;
  const std::vector<RunDatum>& data_;
  std::vector<const Hypothesis*> path_;
  const Hypothesis* chosen_ = nullptr;
  std::set<std::string> dropped_;
};

// True if a hypothesis can be the answer.
bool counts(const Hypothesis& h);

}  // namespace shaker::estimator::diagnosis
