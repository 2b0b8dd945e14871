// A record that is not periodic, made ready for the diagnosis: checked, on an even
// clock, decimated without aliasing, with its noise, and compared as far up in frequency as it says
// anything.
//
// There are no cycles whose scatter would be the noise. It is taken from two records of one
// excitation where there are such (what one repetition does that the other does not), else from the
// part of the response's own spectrum that lies above everything that moves (spectral_floor.hpp),
// carried down to where the response is; so is the noise of the measured excitation.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "base/result.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// On n even steps, sample i at (i + 1/2) dt after `start`.
struct SampledRun {
  std::string name;
  Kind kind = Kind::transient;
  Role role = Role::fit;
  double start = 0.0, dt = 0.0;  // s
  Eigen::VectorXd response;      // what is compared: displacement, or the force of imposed motion
  Eigen::VectorXd excitation;    // empty: none
  Eigen::VectorXd u, v, a;       // the measured motion without what lies above its band
  Eigen::Index keep = 0;         // cosines that are compared
  Eigen::VectorXd variance;      // of the noise of each
  Eigen::VectorXd motion_noise;  // variance of the displacement's own cosines
  Eigen::VectorXd freedom;       // behind those variances
  // Variance of the measured excitation's own noise, of each of its cosines; empty: not known.
  Eigen::VectorXd excitation_noise;
  std::vector<std::string> notes;  // what was done to it, for the operator

  Eigen::Index samples() const { return u.size(); }
  double length() const { return dt * static_cast<double>(u.size()); }
  double highest_frequency() const { return 0.5 * static_cast<double>(keep) / length(); }
};

struct SamplingOptions {
  Eigen::Index most_samples = 3072;  // of a run that are integrated
  Eigen::Index most_cosines = 1200;  // of all runs that are fitted together
};

struct SampledRuns {
  std::vector<std::shared_ptr<SampledRun>> runs;
  std::vector<std::string> left_out;  // a sentence a run that no model can explain
};

// A run with a channel that never changes or with a clipped sensor is left out. An Error is a
// sentence that names the run: columns of different lengths, time that does not increase or has
// gaps; or why no run is left that could be fitted.
Result<SampledRuns> sampled_runs(const std::vector<Recording>& runs,
                                 const SamplingOptions& options = {});

}  // namespace shaker::estimator::diagnosis
