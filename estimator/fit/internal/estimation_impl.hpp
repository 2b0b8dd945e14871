// What an Estimator consists of. Private to the sources of the estimator.
#pragma once

#include <string>
#include <vector>

#include "estimator/fit/internal/fit_inference.hpp"
#include "estimator/fit/internal/searches.hpp"

namespace shaker::estimator {

struct Estimator::Impl {
  Impl(const Model& model, std::vector<RunData> runs, const EstimationOptions& options);

  FitData data;
  PeriodicSolutions solutions;
  GaussNewtonEquations equations;
  Fit fit;
  Fit kept;  // the last fit, during a profile fit
  Search search;
  LiftedSearch lifted;
  NestedSearch nested;
  FitInference inference;

  // --- selection of the branch of solutions: estimation_branch.cpp
  bool start_from_equations();
  void refit_on_data_branch(const std::vector<double>& start);
  std::vector<std::string> branch_warnings();
  // --- gap between model and mean cycles: estimation_gap.cpp
  ModelGap model_gap() const;
  std::vector<std::string> gap_warnings(const ModelGap& gap) const;
};

}  // namespace shaker::estimator
