// The accepted cycles of a campaign as records for those who work on whole runs: the cycles of a
// run one after the other, on equal steps of time. Transients and cycles that were left out are
// gone.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "record/campaign_database.hpp"

namespace shaker::record {

struct AcceptedCycles {
  std::string name;                            // of the run
  double frequency_hz = 0.0, amplitude = 0.0;  // means of the cycles
  // s, m, m/s^2; empty when the run has no accepted cycle. Where the excitation was not measured it
  // is the cosine of the amplitude that was set.
  std::vector<double> t, displacement, excitation;
  // Of the sprung mass, m/s^2, and the load cell, N; empty where the run did not record it. With
  // one of them all columns are raw samples, on the times of the displacement's, of the end of the
  // run and as long as its accepted cycles together: cycles are kept of the displacement and the
  // excitation only.
  std::vector<double> acceleration, force;
};

// One entry a run, in order.
Result<std::vector<AcceptedCycles>> accepted_cycles(const CampaignReader& reader);

}  // namespace shaker::record
