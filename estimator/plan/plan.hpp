// Before the campaign: which runs determine the parameters best.
//
// Every frequency and amplitude that the rig allows gives information about the parameters, J^T J /
// s^2 of its periodic solution at the model's present values; that of a set of runs is the sum.
// Sets are ranked by the D-criterion (the volume of the joint confidence region) and by the
// interval of each single parameter, found greedily and then improved by exchanging runs one by one
// until none helps. So it is known beforehand that figure 13 of the paper cannot determine the
// spring.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/estimation.hpp"

namespace shaker::estimator {

struct PlanLimits {
  double stroke_min = 0.0, stroke_max = 0.0;  // in the model's length unit; equal: no limit
  double stroke_rate_max = 0.0;               // 0: no limit
  double excitation_max = 0.0;                // 0: no limit
  double frequency_min_hz = 0.0, frequency_max_hz = 0.0;  // 0: no limit
};

struct PlanOptions {
  std::vector<double> frequencies_hz, amplitudes;  // all pairs are candidates
  PlanLimits limits;
  std::vector<double> theta;  // where to linearise; empty: the model's starts
  double noise = 0.0;         // standard deviation of one sample
  int points = 64;            // samples a period
  int cycles = 20;            // a run
  int most_runs = 3;          // largest set
  int keep = 5;               // sets of each size
  unsigned threads = 0;
};

struct PlanCandidate {
  double frequency_hz = 0.0, amplitude = 0.0;
  double stroke_low = 0.0, stroke_high = 0.0, rate = 0.0;
  std::string refused;              // why the rig cannot do it; empty: it can
  std::vector<double> information;  // free x free
};

struct PlanSet {
  std::vector<std::size_t> runs;  // indices of candidates, ascending
  bool determined = true;         // all free parameters
  // Geometric mean of the relative errors along the principal axes: det(covariance /
  // theta^2)^(1/2q).
  double spread = 0.0;
  std::vector<double> error;  // standard errors of the free parameters; NaN where undetermined
  double seconds = 0.0;       // of measuring, without settling
  std::vector<std::string> warnings;  // which combinations it leaves open
};

struct Plan {
  std::vector<PlanCandidate> candidates;
  std::vector<PlanSet> sets;      // by size, then best first
  std::vector<PlanSet> sharpest;  // for each free parameter, the set of most_runs best for it alone
  std::vector<int> free;          // the model's parameters that `error` speaks of
};

// An Error for options that contradict each other, or when no candidate is possible on the rig
// (with the commonest reason).
Result<Plan> make_plan(const Model& model, const PlanOptions& options);

// The set's worth by itself: for sets that the caller has in mind.
PlanSet judge(const Model& model, const PlanOptions& options, const Plan& plan,
              std::vector<std::size_t> runs);

}  // namespace shaker::estimator
