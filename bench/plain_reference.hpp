// A reference implementation for job J1 without this library's methods: Ceres around an
// ordinary inner Newton iteration on a plain grid.
//
// It is a fair reference. The residual uses the library's vectorised model; the start comes
// from the harmonics of the data; each inner Newton iteration starts at the solution of the
// last outer iterate and solves only for its step; the last factorisation serves the
// sensitivities; a theta that Ceres evaluates twice is solved once. It lacks what is compared:
// the correction at velocity reversals, the elimination in SIMD lanes, and lifting.
#pragma once

#include <memory>
#include <vector>

#include "estimator/fit/estimation.hpp"

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
