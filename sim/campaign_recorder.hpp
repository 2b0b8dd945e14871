// Records a campaign from the virtual rig without a network: a folder with `campaign.json`
// ("shaker-campaign/1") and one CSV file for each run, which `shakerctl diagnose` and
// `shakerctl estimate` read. Tests, benchmarks and demonstrations use it, because the true
// parameters are known; the folder does not contain them.
//
// Each run starts from rest, so a record begins with the transient. Sampling follows the rig's
// own clock; a cycle is therefore not a whole number of samples, as on a real rig.
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
  RigOptions rig;  // run i uses the seed rig.seed + 7919 i
  std::vector<RecordedRun> runs;
  double ramp_s = 0.5;
  double settle_cycles = 4.0;  // recorded after the ramp, before the requested cycles
  double cycles = 14.0;
};

struct Record {
  std::vector<double> t, excitation, displacement;  // s, m/s^2, m; without the lost samples
};

// Records one run from rest. The index `run` starts at 0. Throws std::invalid_argument when the
// run or the rig options are out of range, and std::runtime_error when the rig trips (the
// damper bottomed). The message names the run, except for wrong rig options.
Record record_run(const CampaignRecording& campaign, std::size_t run);

// Records all runs and writes the folder, which it creates. It does not write the true
// parameters. Throws as record_run does, and std::runtime_error when a file cannot be
// written.
void write_campaign(const CampaignRecording& campaign, const std::filesystem::path& folder);

}  // namespace shaker::sim
