// Port through which the engine records and publishes. An implementation must write a document
// to disk before it gives it to any client.
//
// Called on the engine's thread; must not wait for clients or for the disk. An Error from a
// record_ call (for example a full disk) makes the engine ramp down: data that cannot be kept
// must not be measured.
#pragma once

#include <span>

#include "base/result.hpp"
#include "config/campaign.hpp"
#include "drivers/sensor.hpp"
#include "estimator/online/measured_cycle.hpp"
#include "protocol/documents.hpp"

namespace shaker::daemon {

class Outlet {
 public:
  virtual ~Outlet() = default;
  // Opens the campaign's database. The following samples, cycles and documents belong to it.
  virtual Result<void> record_campaign(const config::CampaignSpec& campaign) = 0;
  virtual Result<void> record_run(int run_index, const config::RunSpec& run) = 0;
  // Called with every raw sample, unchanged, while a campaign is open.
  virtual Result<void> record_samples(std::span<const drivers::Sample> samples) = 0;
  // The resampled cycle, accepted or not. It is durable before any later document is published.
  virtual Result<void> record_cycle(const estimator::MeasuredCycle& cycle, bool accepted) = 0;
  virtual void close_campaign() = 0;

  // Records (while a campaign is open) and publishes one document.
  virtual Result<void> publish(const protocol::Document& document) = 0;

  // Called in every tick. An Error means that data cannot be kept, or that the disk has not
  // answered for too long.
  virtual Result<void> healthy() { return {}; }
};

}  // namespace shaker::daemon
