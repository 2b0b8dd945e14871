// Which hypothesis is the answer.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

// What a fit leaves of a run, in harmonics.
Eigen::VectorXd residual_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                            std::size_t run);

// Both must outlive it.
class Choice {
 public:
  Choice(const Selection& found, const std::vector<RunDatum>& data);

  // The best hypothesis; where something unknown is left, the smallest one of which no larger one
  // halves what it leaves: a known effect must not be made to mend an unknown one. Null: none.
  const Hypothesis* chosen() const { return chosen_; }
  // From nothing, an effect more each.
  const std::vector<const Hypothesis*>& path() const { return path_; }
  // Share of the gap's square that a fit leaves of another's, in units of the noise or in the
  // response's own: where the model is far from the data the noise says little of what matters.
  double left_of(const Hypothesis& one, const Hypothesis& other) const;
  // Chooses again, without those of its effects that are not worth a name, now or later: what the
  // others of them leave, or else the likeliest of as few effects. False when all of them are.
  // `probability`: of an effect.
  bool drop_unlikely(const std::function<double(const std::string&)>& probability, double least);

 private:
  void drop_idle();
  const Hypothesis* after(const Hypothesis& smallest) const;
  const std::vector<RunDatum>& data_of(const Hypothesis& h) const;

  const Selection& found_;
  const std::vector<RunDatum>& data_;
  std::vector<const Hypothesis*> path_;
  const Hypothesis* chosen_ = nullptr;
  std::set<std::string> dropped_;
};

// It can be the answer.
bool counts(const Hypothesis& h);

}  // namespace shaker::estimator::diagnosis
