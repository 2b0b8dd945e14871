// A record cut into whole cycles against the excitation's own phase, each said in harmonics.
//
// The excitation's frequency and phase are fitted (tau = 0 is the crest of its fundamental), the
// ramps and the transient are dropped, trend and subharmonics looked for. What is left is one row
// of harmonics a cycle: their mean is the datum, their scatter is the noise. Cycles are fitted by
// least squares, so that samples need not be whole in number nor evenly spaced.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "base/result.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/cycles/jump_sampling.hpp"

namespace shaker::estimator::diagnosis {

struct SteadyOptions {
  int harmonics = 16;  // fewer when the sampling does not carry them
  int excitation_harmonics = 8;
  int fewest_cycles = 3;
  double drift = 0.0;  // of the displacement's zero, per second: taken out of the record
};

struct SteadyRun {
  std::string name;
  Kind kind = Kind::periodic;
  Role role = Role::fit;
  double frequency_hz = 0.0;       // measured
  config::RunCondition condition;  // of the recording
  int harmonics = 0, driver_harmonics = 0;
  // A row a cycle. `response` is what is predicted (displacement, or the force of imposed motion);
  // `driver` is what is imposed (excitation, or displacement).
  Eigen::MatrixXd response, driver;
  Eigen::MatrixXd acceleration, force;  // of a periodic response; empty without such a channel
  bool driver_measured = true;          // false: the driver is the commanded pure cosine
  Eigen::VectorXd when;                 // middle of each cycle, s after the record's first sample
  double recorded_at = 0.0;             // that sample's time on the campaign's clock
  double quantisation_step = 0.0;       // step of the grid on which the response is stored; 0: none
  JumpSampling sampling;                // of a force that is the response
  double drift_taken = 0.0;             // SteadyOptions::drift
  double zero_error = 0.0;              // of the mean, because the zero has moved
  int cycles_recorded = 0, cycles_dropped = 0;
  double samples_a_cycle = 0.0;
  int subharmonic = 0;    // repeats only every so many cycles; 0: every one
  bool dying = false;     // and what repeats so is the rest of a transient
  bool drifting = false;  // a trend is left that the scatter does not explain
  std::vector<std::string> warnings;

  int cycles() const { return static_cast<int>(response.rows()); }
  Eigen::VectorXd mean() const { return response.colwise().mean(); }
  Eigen::VectorXd mean_driver() const { return driver.colwise().mean(); }
};

// An Error is a sentence that names the run: columns of different lengths, time that does not
// increase, an excitation that never changes, fewer than three steady cycles, a subharmonic
// response, a clipped sensor.
Result<SteadyRun> steady_cycles(const Recording& recording, const SteadyOptions& options = {});

}  // namespace shaker::estimator::diagnosis
