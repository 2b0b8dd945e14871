// A fit on the usual grid, or on the grid that a required accuracy of the parameters needs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "estimator/fit/accurate_estimation.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::cli {

class RefinedFit {
 public:
  // accuracy: relative, of every parameter; 0 selects the usual grid. `model` must outlive the
  // object. Throws as Estimator does.
  RefinedFit(const estimator::Model& model, const std::vector<estimator::RunData>& runs,
             const estimator::EstimationOptions& how, double accuracy);

  const estimator::Fit& fit(const std::vector<double>& start);
  estimator::Estimator& estimator() { return refined_ ? refined_->finest() : *usual_; }
  // Adds a warning when the accuracy was not reached.
  estimator::Estimate describe();

  bool refined() const { return refined_.has_value(); }
  // Only for a refined fit: the accuracy reached, for an operator and for programs (points,
  // reached, error).
  std::string sentence() const;
  nlohmann::ordered_json grid() const;

 private:
  std::optional<estimator::Estimator> usual_;
  std::optional<estimator::AccurateEstimator> refined_;
};

}  // namespace shaker::cli
