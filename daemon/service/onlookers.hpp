// What only people who look on need: waves, the scope and the rig. Gives it to the clients that
// subscribed.
//
// Runs on the clients' thread and touches no object of the engine. Samples come through rings of
// their own, which the acquisition threads fill only while somebody wants the scope. If this
// thread is late, those rings run over and the picture has a gap; nothing else notices.
#pragma once

#include <array>
#include <memory>

#include "config/rig.hpp"
#include "daemon/publish/commands.hpp"
#include "daemon/publish/scope_bins.hpp"
#include "daemon/publish/stream_server.hpp"
#include "daemon/service/engine_control.hpp"
#include "daemon/service/rig_thread.hpp"
#include "daemon/workers/wave_box.hpp"

namespace shaker::daemon {

class Onlookers {
 public:
  // All arguments outlive it. Publishes the rig at once.
  Onlookers(const config::RigConfig& rig, Sensors& sensors, WaveBox& waves,
            const Commands& commands, const EngineControl& control, StreamServer& server);

  // Call every few milliseconds.
  void tick(Nanoseconds now);

 private:
  void show_rig();
  void show_samples(Nanoseconds now);

  Sensors& sensors_;
  WaveBox& waves_;
  const Commands& commands_;
  const EngineControl& control_;
  StreamServer& server_;
  protocol::RigDocument rig_;
  std::shared_ptr<const config::CampaignSpec> planned_;  // that of `rig_`
  ScopeBins bins_;
  bool viewed_ = false;
  std::array<drivers::Sample, 1024> samples_;
};

protocol::RigDocument rig_document(const config::RigConfig& rig);

}  // namespace shaker::daemon
