// The gap before and after, of all runs together and run by run.
#pragma once

#include <vector>

#include "estimator/discrepancy/diagnosis.hpp"
#include "estimator/discrepancy/harmonic_fit.hpp"
#include "estimator/discrepancy/steady_cycles.hpp"

namespace shaker::estimator::discrepancy {

// A fit with the data that it was fitted to.
struct Fitted {
  const HarmonicFit& fit;
  const std::vector<RunDatum>& data;
};

// Fills gap and runs of `said`, but for the noise. `runs` in the order of `data`.
void tell_gaps(const Fitted& before, const Fitted& after, const std::vector<RunDatum>& data,
               const std::vector<SteadyRun>& runs, Diagnosis& said);

}  // namespace shaker::estimator::discrepancy
