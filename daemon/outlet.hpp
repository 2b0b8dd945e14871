// Where the engine says what happens. The recorder has written it to disk before the publisher
// gives it to anyone: an implementation must keep that order.
//
// Called on the engine's thread; must wait neither for clients nor for the disk. An Error from a
// record_ call (a full disk) makes the engine ramp down: nothing may be measured that cannot be
// kept.
#pragma once

#include <span>

#include "base/result.hpp"
#include "config/campaign.hpp"
#include "drivers/sensor.hpp"
#include "estimator/measured_cycle.hpp"
#include "protocol/documents.hpp"

namespace shaker::daemon {

class Outlet {
 public:
  virtual ~Outlet() = default;
  // Opens the campaign's database; the samples, cycles and documents that follow belong to it.
  virtual Result<void> record_campaign(const config::CampaignSpec& campaign) = 0;
  virtual Result<void> record_run(int run_index, const config::RunSpec& run) = 0;
  // Every raw sample while a campaign is open, as it came.
  virtual Result<void> record_samples(std::span<const drivers::Sample> samples) = 0;
  // The resampled cycle, accepted or not. Durable before any document that is published after it.
  virtual Result<void> record_cycle(const estimator::MeasuredCycle& cycle, bool accepted) = 0;
  virtual void close_campaign() = 0;

  // Records (while a campaign is open) and publishes one document.
  virtual Result<void> publish(const protocol::Document& document) = 0;

  // Asked at every turn: an Error when what was handed over cannot be kept, or the disk has not
  // answered for too long.
  virtual Result<void> healthy() { return {}; }
};

}  // namespace shaker::daemon
