// The Statistical Reference Datasets of NIST for nonlinear regression
// (https://www.itl.nist.gov/div898/strd, public domain): observations, two starts, certified
// values.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/paper/optimisers/internal/formula_problem.hpp"

namespace shaker::estimator::optimisers::testing {

struct NistSet {
  std::string name;
  std::vector<double> start[2];
  std::vector<double> certified, deviation;
  double residual_sum = 0.0;
  int degrees_of_freedom = 0;
  FormulaData data;  // in the file y comes first
};

// Reads NAME.dat in the published format. Throws std::runtime_error when it cannot be parsed.
NistSet read_nist(const std::filesystem::path& file);
// The 27 sets of tests/data/nist, in the order of their names.
std::vector<NistSet> nist_sets();

}  // namespace shaker::estimator::optimisers::testing
