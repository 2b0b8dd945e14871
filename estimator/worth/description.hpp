// A fit as an estimate to be published: names, units, intervals and warnings.
//
// What the numbers say by themselves; Estimator::describe adds runs, cycles and what it knows of
// the branch of solutions.
#pragma once

#include "estimator/estimate.hpp"
#include "estimator/estimation.hpp"

namespace shaker::estimator {

Estimate describe(const Model& model, const Fit& fit);

}  // namespace shaker::estimator
