// What one would build without this library: Ceres around an ordinary inner Newton on a plain grid.
//
// The yardstick for job J1, and no straw man: the residual is the library's vectorised model, the
// start comes from the data's harmonics, every inner Newton begins at the last outer iterate's
// solution and solves for its step alone, the last factorisation serves the sensitivities, and a
// theta that Ceres asks for twice is solved once. What it does not have is what is compared: the
// kinks' correction, the elimination in SIMD lanes, lifting.
#pragma once

#include <memory>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::bench {

class PlainReference {
 public:
  PlainReference(const estimator::Model& model, estimator::RunData run, estimator::Scheme scheme,
                 int points, double tolerance);
  ~PlainReference();
  const std::vector<double>& fit(const std::vector<double>& start);
  int iterations() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::bench
