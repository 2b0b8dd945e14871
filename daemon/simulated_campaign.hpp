// Runs a whole campaign on one thread in simulated time, with devices, engine and estimator
// inline.
//
// Uses the engine, driver ports and estimator of the service, without its threads, sockets and
// disk. Three dwells take seconds. For tests, for trying a campaign file, and for benchmarks.
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
  std::vector<protocol::Document> documents;       // all published documents, in order
  std::vector<estimator::MeasuredCycle> accepted;  // as passed to the estimator
  std::uint64_t samples = 0;                       // number of recorded samples
  double duration_s = 0.0;                         // of simulated time
  State final_state = State::idle;
};

struct SimulationOptions {
  double at_most_s = 3600.0;  // limit of simulated time; then an Error (timeout)
  Nanoseconds tick = std::chrono::milliseconds(5);
  // Called after every tick with the seconds since the start; may inject faults, stops and
  // acknowledgements.
  std::function<void(Engine&, double)> each_tick;
};

// Returns when the campaign is over and the rig is IDLE or in FAULT. Returns an Error if a
// device cannot be connected, the campaign is refused, the estimator does not know the model,
// or the time limit is reached.
Result<SimulatedCampaign> run_simulated_campaign(const config::RigConfig& rig,
                                                 const config::CampaignSpec& campaign,
                                                 const SimulationOptions& options = {});

// The same with the caller's devices and clock, for fault injection.
Result<SimulatedCampaign> run_simulated_campaign(const config::RigConfig& rig,
                                                 const config::CampaignSpec& campaign,
                                                 const SimulationOptions& options,
                                                 drivers::Devices& devices, SimulatedClock& clock);

}  // namespace shaker::daemon
