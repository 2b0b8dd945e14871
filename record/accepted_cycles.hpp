// Reads the accepted cycles of a campaign as one record for each run: its cycles one after the
// other, on equal steps of time, without transients and rejected cycles.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "record/campaign_database.hpp"

namespace shaker::record {

struct AcceptedCycles {
  std::string name;                            // of the run
  double frequency_hz = 0.0, amplitude = 0.0;  // means over the cycles
  // s, m, m/s^2; empty if the run has no accepted cycle. If a cycle has no measured excitation,
  // the column is the cosine with the amplitude of the cycle.
  std::vector<double> t, displacement, excitation;
  // Acceleration of the sprung mass, m/s^2, and force of the load cell, N; empty if not
  // recorded. If one of them is there, all columns are raw samples at the times of the
  // displacement samples, from the end of the run and as long as its accepted cycles together,
  // because cycles contain displacement and excitation only.
  std::vector<double> acceleration, force;
};

// One entry for each run, in order. An Error is the reader's.
Result<std::vector<AcceptedCycles>> accepted_cycles(const CampaignReader& reader);

}  // namespace shaker::record
