// Prepares a record without a period for the diagnosis: checks it, puts it on an even clock,
// decimates it without aliasing, estimates its noise, and decides up to which frequency it is
// compared.
//
// There are no cycles with a scatter. The noise comes from two records of one excitation if there
// are such (their difference), otherwise from the spectrum of the response above all that moves
// (spectral_floor.hpp), extrapolated to lower frequencies. The noise of the measured excitation is
// found in the same way.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "base/result.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/solve/time/excitation.hpp"

namespace shaker::estimator::diagnosis {

// A record on n even steps: sample i is at (i + 1/2) dt after `start`.
struct SampledRun {
  std::string name;    // of the run, and which part of it where that is not all
  std::string record;  // name of the recording
  Kind kind = Kind::transient;
  Role role = Role::fit;
  config::RunCondition condition;  // of the recording
  double start = 0.0, dt = 0.0;    // s
  Eigen::VectorXd response;        // what is compared: displacement, or the force of imposed motion
  Eigen::VectorXd excitation;      // empty: none
  Eigen::VectorXd u, v, a;         // the measured motion without what lies above its band
  Eigen::Index keep = 0;           // cosines that are compared
  Eigen::VectorXd variance;        // of the noise of each
  Eigen::VectorXd motion_noise;    // variance of the displacement's own cosines
  // Variance of the noise of a sample of the displacement as it was recorded.
  double sample_noise = 0.0;
  Eigen::VectorXd freedom;  // behind those variances
  // Variance of the measured excitation's own noise, of each of its cosines; empty: not known.
  Eigen::VectorXd excitation_noise;
  std::vector<std::string> notes;  // what was done to it, for the operator

  Eigen::Index samples() const { return u.size(); }
  double length() const { return dt * static_cast<double>(u.size()); }
  double highest_frequency() const { return 0.5 * static_cast<double>(keep) / length(); }
};

struct SamplingOptions {
  Eigen::Index most_samples = 3072;  // of a run that are integrated
  // Of all imposed motions together: to evaluate forces along a motion costs less than to integrate.
  // Each of them may have `most_samples`.
  Eigen::Index most_along_motion = 12288;
  Eigen::Index most_cosines = 1200;  // of all runs that are fitted together
};

struct SampledRuns {
  std::vector<std::shared_ptr<SampledRun>> runs;
  std::vector<std::string> left_out;  // a sentence a run that no model can explain
};

// Leaves out runs with a channel that never changes or with a clipped sensor. An Error names the
// run (columns of different lengths, time that does not increase or has gaps), or says why no run
// is left to be fitted.
Result<SampledRuns> sampled_runs(const std::vector<Recording>& runs,
                                 const SamplingOptions& options = {});

// The excitation's course over the record; between the samples as its cosines say, not as a polynomial
// through few of them would. Empty where the run has none.
Excitation excitation_of(const SampledRun& run);

}  // namespace shaker::estimator::diagnosis
