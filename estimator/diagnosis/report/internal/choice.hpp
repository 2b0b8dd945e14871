// Which hypothesis is the answer.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

// Residual of a run in harmonics.
Eigen::VectorXd residual_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                            std::size_t run);

// The arguments of the constructor must outlive the object.
class Choice {
 public:
  Choice(const Selection& found, const std::vector<RunDatum>& data);

  // The best hypothesis; if something unknown is left, the one that weighs most (weights.hpp). Null:
  // none.
  const Hypothesis* chosen() const { return chosen_; }
  // Share of the squared gap of `other` that `one` leaves, in units of the noise or in the unit of
  // the response: far from the data the noise is a bad measure.
  double left_of(const Hypothesis& one, const Hypothesis& other) const;
  // Chooses again without the effects whose probability is below `least`, until all of them are
  // above it: the hypothesis that weighs most, of those with as few effects. Returns false if no
  // effect remains. `probability`: of an effect.
  bool drop_unlikely(const std::function<double(const std::string&)>& probability, double least);

 private:
  void name_simpler();
  const Hypothesis* heaviest(std::size_t most) const;
  const std::vector<RunDatum>& data_of(const Hypothesis& h) const;

  const Selection& found_;
  const std::vector<RunDatum>& data_;
  const Hypothesis* chosen_ = nullptr;
  std::set<std::string> dropped_;
};

}  // namespace shaker::estimator::diagnosis
