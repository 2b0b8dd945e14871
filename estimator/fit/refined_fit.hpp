// A fit on the usual grid, or on the grid that a required accuracy of the parameters needs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/fit/internal/accurate_estimation.hpp"

namespace shaker::estimator {

// The accuracy with which `runs` should be fitted where none is asked for (`asked` is 0). The usual
// grid misses a friction that changes its sign within one grid step, and so its parameters cannot be
// estimated: where the model states the smoothing width, the grid is refined.
double accuracy_for(const config::ModelSpec& model, const std::vector<RunData>& runs, double asked);

class RefinedFit {
 public:
  // accuracy: relative, of every parameter; 0 selects the usual grid. `model` must outlive the
  // object. Throws as Estimator does.
  RefinedFit(const Model& model, const std::vector<RunData>& runs, const EstimationOptions& how,
             double accuracy);

  const Fit& fit(const std::vector<double>& start);
  Estimator& estimator() { return refined_ ? refined_->finest() : *usual_; }
  // Adds a warning when the accuracy was not reached.
  Estimate describe();

  bool refined() const { return refined_.has_value(); }
  // Only for a refined fit: its grid and the accuracy reached, and both in words.
  const AccurateEstimator& grids() const { return *refined_; }
  std::string sentence() const;

 private:
  std::optional<Estimator> usual_;
  std::optional<AccurateEstimator> refined_;
};

}  // namespace shaker::estimator
