// Campaigns from the virtual rig, which shares no code with the estimator.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "estimator/diagnosis/campaign.hpp"
#include "sim/campaign_recorder.hpp"

namespace shaker::estimator::diagnosis::testing {

struct Setting {
  double frequency_hz, amplitude;
};

inline const std::vector<Setting> kSixRuns = {{1.2, 2.0}, {1.2, 3.2}, {2.0, 1.5},
                                              {2.0, 3.0}, {3.0, 3.0}, {3.0, 6.0}};

inline Campaign recorded(const std::map<std::string, double>& truth,
                         const std::vector<Setting>& settings, std::uint64_t seed,
                         const std::string& plant = "oleo", double noise = 2e-5) {
  sim::CampaignRecording recording;
  recording.rig.plant = plant;
  recording.rig.parameters = truth;
  recording.rig.seed = seed;
  recording.rig.noise_m = noise;
  recording.rig.sample_rate_hz = 997.0;
  for (std::size_t i = 0; i < settings.size(); ++i)
    recording.runs.push_back(
        {"r" + std::to_string(i + 1), settings[i].frequency_hz, settings[i].amplitude, false});
  Campaign campaign;
  campaign.name = "test";
  for (std::size_t i = 0; i < settings.size(); ++i) {
    sim::Record record = sim::record_run(recording, i);
    Recording run;
    run.name = recording.runs[i].name;
    run.frequency_hz = settings[i].frequency_hz;
    run.amplitude = settings[i].amplitude;
    run.t = std::move(record.t);
    run.displacement = std::move(record.displacement);
    run.excitation = std::move(record.excitation);
    campaign.runs.push_back(std::move(run));
  }
  return campaign;
}

}  // namespace shaker::estimator::diagnosis::testing
