// A campaign recorded from the virtual rig without wires, in a folder that `shakerctl diagnose` and
// `shakerctl estimate` read: `campaign.json` ("shaker-campaign/1") and one CSV a run. For tests,
// benchmarks and demonstrations with a truth that is known, and hidden.
//
// Each run starts from rest, so a record begins with the transient; sampling runs on the rig's
// clock and a cycle is no whole number of samples, as on a real rig.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sim/virtual_rig.hpp"

namespace shaker::sim {

struct RecordedRun {
  std::string name;
  double frequency_hz = 0.0, amplitude = 0.0;  // Hz, m/s^2
  bool held_out = false;                       // role "held_out" instead of "fit"
};

struct CampaignRecording {
  RigOptions rig;  // each run takes rig.seed and its own number
  std::vector<RecordedRun> runs;
  double ramp_s = 0.5;
  double settle_cycles = 4.0;  // in the record, before those that one asks for
  double cycles = 14.0;
};

struct Record {
  std::vector<double> t, excitation, displacement;  // s, m/s^2, m; lost samples are not in it
};

// One run from rest. Throws std::invalid_argument for a run out of the rig's range or rig options
// that are wrong, std::runtime_error when the rig trips (the damper bottomed): with the run's name.
Record record_run(const CampaignRecording& campaign, std::size_t run);

// Writes the folder, which is made. The truth is not in it.
void write_campaign(const CampaignRecording& campaign, const std::filesystem::path& folder);

}  // namespace shaker::sim
