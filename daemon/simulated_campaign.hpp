// A whole campaign on one thread in simulated time: devices, engine and estimator inline.
//
// The same engine, drivers' ports and estimator as in the service, without its threads, sockets and
// disk; three dwells take seconds. For tests, for trying a campaign file, and for benchmarks.
#pragma once

#include <functional>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/campaign.hpp"
#include "config/rig.hpp"
#include "daemon/engine.hpp"
#include "drivers/factory.hpp"

namespace shaker::daemon {

struct SimulatedCampaign {
  std::vector<protocol::Document> documents;       // all that was published, in order
  std::vector<estimator::MeasuredCycle> accepted;  // as the estimator saw them
  std::uint64_t samples = 0;                       // recorded
  double duration_s = 0.0;                         // of simulated time
  State final_state = State::idle;
};

struct SimulationOptions {
  double at_most_s = 3600.0;  // of simulated time; then an Error (timeout)
  Nanoseconds tick = std::chrono::milliseconds(5);
  // Called after every tick with the seconds since the start: faults, stops, acknowledgements.
  std::function<void(Engine&, double)> each_tick;
};

// Ends when the campaign is over and the rig is IDLE or in FAULT. An Error when the devices cannot
// be connected, the campaign is refused, or the model is unknown to the estimator.
Result<SimulatedCampaign> run_simulated_campaign(const config::RigConfig& rig,
                                                 const config::CampaignSpec& campaign,
                                                 const SimulationOptions& options = {});

// The same with devices and a clock of the caller's, to inject faults into.
Result<SimulatedCampaign> run_simulated_campaign(const config::RigConfig& rig,
                                                 const config::CampaignSpec& campaign,
                                                 const SimulationOptions& options,
                                                 drivers::Devices& devices, SimulatedClock& clock);

}  // namespace shaker::daemon
