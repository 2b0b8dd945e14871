// Experiment design before the campaign: selects the runs that determine the parameters best.
//
// The candidates are all pairs of the given frequencies and amplitudes. The information of a
// candidate is J^T J / s^2 of its periodic solution at the given parameter values; that of a
// set of runs is the sum. Sets are ranked by the D-criterion (the volume of the joint
// confidence region) and by the standard error of each single parameter. A greedy search finds
// them, and an exchange of single runs improves them until no exchange helps. The plan
// predicts, for example, that the runs of figure 13 of the paper cannot determine the spring.
//
// Instead of the volume, a plan may aim at one quantity of the parameters (the peak load of a drop,
// a parameter): sets are then ranked by its standard error (C-criterion), linearised, and by a
// twentieth of the volume, so that no other parameter stays open. An aim is averaged over the
// dampers that the prior allows: the logarithm of its standard error at each. With a given rig time
// the runs of a set share it, and each gives up `settle_cycles` of its own. With an aim they share it
// as serves it best, and further candidates are tried about the runs of the best sets.
//
// A parameter that varies per run has a value of its own in each run of a set. Its errors are those
// of the mean of these values. One that varies per group, or over a condition, is a joint parameter.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

struct PlanLimits {
  double stroke_min = 0.0, stroke_max = 0.0;  // in the model's length unit; equal: no limit
  double stroke_rate_max = 0.0;               // length unit per s; 0: no limit
  double excitation_max = 0.0;                // length unit per s^2; 0: no limit
  double frequency_min_hz = 0.0, frequency_max_hz = 0.0;  // 0: no limit
};

// A damper that the prior allows: all parameters, and the derivatives of the aim at it.
struct PlanPoint {
  std::vector<double> theta, aim;
};

struct PlanOptions {
  std::vector<double> frequencies_hz, amplitudes;  // all pairs are candidates
  PlanLimits limits;
  std::vector<double> theta;  // all parameters, point of linearisation; empty: the model's starts
  double noise = 0.0;         // standard deviation of one sample, above 0
  int points = 64;            // samples per period, at least 8
  int cycles = 20;            // per run
  int most_runs = 3;          // in the largest set
  int keep = 5;               // number of sets of each size
  unsigned threads = 0;       // 0: one for each core
  std::vector<double> aim;    // derivatives of one quantity over all parameters; empty: the volume
  std::vector<PlanPoint> prior;  // over which an aim is averaged; empty: `theta` alone
  int refinements = 0;           // rounds of further candidates about the best sets, with an aim
  double minutes = 0.0;          // rig time of every set, in place of `cycles`; 0: `cycles` each
  double settle_cycles = 10;     // that the rig takes before it measures, with `minutes`
};

struct PlanCandidate {
  double frequency_hz = 0.0, amplitude = 0.0;
  double stroke_low = 0.0, stroke_high = 0.0, rate = 0.0;  // extremes of the predicted motion
  std::string refused;                          // reason why the rig cannot do it; empty: it can
  std::vector<double> information;              // free x free; empty if refused
  std::vector<std::vector<double>> over_prior;  // the same at each point of the prior
};

struct PlanSet {
  std::vector<std::size_t> runs;  // indices of candidates, ascending
  bool determined = true;         // all free parameters
  // Geometric mean of the relative errors along the principal axes: det(covariance /
  // theta^2)^(1/2q).
  double spread = 0.0;
  std::vector<double> error;          // standard errors of the free parameters; NaN if undetermined
  double seconds = 0.0;               // measuring time, without settling
  std::vector<double> cycles;         // of each run
  std::vector<double> share;          // of the rig time, of each run; empty: equal ones
  double aim_error = 0.0;             // standard error of the aim, at theta; 0 without one
  double aim_over_prior = 0.0;        // its median over the prior; the same without a prior
  std::vector<std::string> warnings;  // names the combinations that the set does not determine
};

struct Plan {
  std::vector<PlanCandidate> candidates;
  std::vector<PlanSet> sets;       // by size, then best first
  std::vector<PlanSet> sharpest;   // for each free parameter, its best set of most_runs runs
  std::vector<int> free;           // the model's free parameters, in the order of `error`
  std::vector<PlanSet> by_volume;  // with an aim: the best set of most_runs runs by the volume
};

// A positive frequency or amplitude, rounded to three significant digits: one that can be read, and
// that a rig can be set to.
double settable(double value);

// Makes a plan. It blocks until all candidates are examined on `threads` threads. Returns an
// Error if options are invalid, or if the rig can do no candidate (with the most frequent
// reason).
Result<Plan> make_plan(const Model& model, const PlanOptions& options);

// Evaluates one set that the caller chooses. `runs`: indices of candidates that are not refused.
// `share`: of the rig time, one for each run, in their order; empty: equal ones.
PlanSet judge(const Model& model, const PlanOptions& options, const Plan& plan,
              std::vector<std::size_t> runs, std::vector<double> share = {});

}  // namespace shaker::estimator
