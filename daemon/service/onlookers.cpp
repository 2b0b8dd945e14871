#include "daemon/service/onlookers.hpp"

#include <set>
#include <span>

#include "daemon/safety/detectors.hpp"

namespace shaker::daemon {
namespace {

constexpr int kMaxReadsPerTick = 16;  // of a sensor's ring: no tick takes long

}  // namespace

protocol::RigDocument rig_document(const config::RigConfig& rig) {
  const config::Limits& limits = rig.limits;
  protocol::RigDocument document;
  document.rig = rig.name;
  document.stroke_min_m = limits.stroke_min_m;
  document.stroke_max_m = limits.stroke_max_m;
  document.stroke_rate_max_m_s = limits.stroke_rate_max_m_s;
  document.excitation_max_m_s2 = limits.excitation_max_m_s2;
  document.frequency_min_hz = limits.frequency_min_hz;
  document.frequency_max_hz = limits.frequency_max_hz;
  document.stale_s = limits.stale_s;
  document.ramp_s = rig.exciter.ramp_s;
  document.client_lease_s = rig.client_lease_s;
  document.unprotected = rig.unprotected;
  for (const config::Guard& guard : config::guards(limits)) {
    if (guard.on) document.detectors.push_back({guard.key, std::string(name(guard.action))});
  }
  std::set<protocol::Channel> channels;
  for (const auto& sensor : rig.sensors) {
    for (const protocol::Channel channel : config::channels_of(sensor))
      channels.insert(channel);
  }
  for (const protocol::Channel channel : channels) {
    const protocol::ChannelLabel label = protocol::label(channel, rig.auxiliary);
    document.channels.push_back({std::string(protocol::name(channel)), label.name, label.unit});
  }
  return document;
}

Onlookers::Onlookers(const config::RigConfig& rig, Sensors& sensors, WaveBox& waves,
                     const Commands& commands, const EngineControl& control, StreamServer& server)
    : sensors_(sensors),
      waves_(waves),
      commands_(commands),
      control_(control),
      server_(server),
      rig_(rig_document(rig)) {
  server_.publish_extra(rig_);
}

void Onlookers::tick(Nanoseconds now) {
  for (auto& wave : waves_.take())
    server_.publish_extra(std::move(wave));
  show_rig();
  show_samples(now);
}

void Onlookers::show_rig() {
  auto in_control = commands_.in_control();
  auto planned = control_.last_campaign();
  if (in_control == rig_.in_control && planned == planned_) return;
  rig_.in_control = std::move(in_control);
  if (planned != planned_) {
    planned_ = std::move(planned);
    protocol::PlannedCampaign plan{
        planned_->name, planned_->settle_tolerance, {}, config::entries(planned_->specimen)};
    for (const config::RunSpec& run : planned_->runs)
      plan.runs.push_back({run.name, run.frequency_hz, run.amplitude, run.cycles});
    rig_.plan = std::move(plan);
  }
  server_.publish_extra(rig_);
}

void Onlookers::show_samples(Nanoseconds now) {
  const bool wanted = server_.wants("scope");
  if (wanted != viewed_) {
    viewed_ = wanted;
    bins_.clear();
    for (const auto& sensor : sensors_) {
      sensor->view(wanted);
      // What is left of an earlier view is old.
      for (int reads = 0; reads < kMaxReadsPerTick && sensor->drain_view(samples_) > 0;)
        ++reads;
    }
  }
  if (!wanted) return;
  for (const auto& sensor : sensors_) {
    for (int reads = 0; reads < kMaxReadsPerTick; ++reads) {
      const std::size_t count = sensor->drain_view(samples_);
      if (count == 0) break;
      bins_.add(std::span(samples_).first(count));
    }
  }
  if (auto document = bins_.take(now)) server_.publish_extra(std::move(*document));
}

}  // namespace shaker::daemon
