#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "daemon/engine_impl.hpp"
#include "protocol/standing_alarms.hpp"

namespace shaker::daemon {
namespace {

using protocol::Channel;

std::string quality_name(const ChannelMonitor& monitor) {
  if (!monitor.seen()) return "none";
  switch (monitor.quality()) {
    case drivers::Quality::good:
      return "good";
    case drivers::Quality::suspect:
      return "suspect";
    case drivers::Quality::bad:
      return "bad";
  }
  return "bad";
}

// Largest speed of the resampled stroke, m/s.
std::optional<double> stroke_rate(const AssembledCycle& cycle) {
  const auto& u = cycle.measured.displacement;
  const std::size_t n = u.size();
  if (!cycle.whole || n < 3) return std::nullopt;
  double most = 0.0;
  for (std::size_t i = 0; i < n; ++i)
    most = std::max(most, std::abs(u[(i + 1) % n] - u[(i + n - 1) % n]));
  return most / 2.0 * static_cast<double>(n) * cycle.measured.frequency_hz;
}

// Estimated cycles in SETTLE for the progress bar: the window of the gate and a little more.
constexpr double kSettleGuess = 12.0;

}  // namespace

void Engine::Impl::publish(const protocol::Document& document) {
  if (const auto* raised = std::get_if<protocol::AlarmDocument>(&document)) {
    if (raised->severity == "error") ++standing_errors;
    if (raised->severity == "warning") ++standing_warnings;
  }
  keep(outlet.publish(document));
}

void Engine::Impl::acknowledge_alarms(const std::string& who) {
  standing_errors = standing_warnings = 0;
  if (resting()) episode.clear();
  alarm("info", std::string(protocol::kAcknowledged), fmt::format("acknowledged by {}", who));
}

// Who starts a campaign has seen the warnings; an error stays.
void Engine::Impl::set_warnings_aside() {
  if (std::exchange(standing_warnings, 0) == 0) return;
  alarm("info", std::string(protocol::kWarningsSetAside),
        "a campaign begins; the warnings before it are set aside");
}

void Engine::Impl::alarm(const std::string& severity, const std::string& code,
                         const std::string& text, std::optional<config::Action> action) {
  protocol::AlarmDocument document;
  document.severity = severity;
  document.code = code;
  document.text = text;
  if (action) document.action = std::string(name(*action));
  raise(std::move(document));
}

// One incident gives one error. Until the rig is IDLE again, somebody acknowledges it or a campaign
// begins, later errors name the first one as their cause and become warnings, except those that the
// table may still move and the emergency stop.
void Engine::Impl::raise(protocol::AlarmDocument document) {
  if (document.severity == "error") {
    if (episode.empty()) {
      episode = document.code;
    } else {
      document.cause = episode;
      if (document.code != "stop_not_obeyed" && document.code != "emergency_stop")
        document.severity = "warning";
    }
  }
  publish(document);
}

void Engine::Impl::detector_alarm(Detector detector, config::Action action) {
  const Level& level = detectors.level(detector);
  raise({.severity = action == config::Action::indicate ? "warning" : "error",
         .code = std::string(row(detector).code),
         .text = detectors.text(detector),
         .action = std::string(name(action)),
         .channel = std::string(protocol::name(level.channel)),
         .value = level.value,
         .limit = level.limit});
}

// An absent device reports every attempt ("next attempt in 0.4 s"), mixed with reports of other
// devices. Each is published once in kSameAlarmS. Texts that differ only in their numbers are
// equal.
void Engine::Impl::alarm_once(const std::string& code, const std::string& text) {
  std::string key = code + text;
  std::erase_if(key, [](char c) { return (c >= '0' && c <= '9') || c == '.'; });
  std::erase_if(said, [&](const Said& s) { return since(s.t) >= kSameAlarmS; });
  if (std::ranges::find(said, key, &Said::key) != said.end()) return;
  if (said.size() < kSaidMost) said.push_back({std::move(key), clock.now()});
  alarm("warning", code, text, config::Action::indicate);
}

void Engine::Impl::publish_cycle(const AssembledCycle& cycle, bool accepted, const std::string& why,
                                 const GateVerdict& verdict) {
  publish(protocol::CycleDocument{.campaign = campaign->name,
                                  .run = run().name,
                                  .cycle = run_cycles,
                                  .accepted = accepted,
                                  .why = why,
                                  .frequency_hz = cycle.measured.frequency_hz,
                                  .amplitude = cycle.measured.amplitude,
                                  .stroke_min_m = cycle.stroke_min,
                                  .stroke_max_m = cycle.stroke_max,
                                  .change = verdict.change,
                                  .gaps = cycle.gaps,
                                  .samples = cycle.samples,
                                  .jitter_fraction = cycle.jitter_fraction,
                                  .subharmonic = verdict.subharmonic,
                                  .ordered = order_of_cycle,
                                  .corrected_to = corrected_to,
                                  .stroke_rate_m_s = stroke_rate(cycle)});
}

protocol::ChannelHealth Engine::Impl::channel_health(Channel channel) {
  const auto& m = monitor(channel);
  auto& counted_before = counted[static_cast<std::size_t>(channel)];
  protocol::ChannelHealth health;
  health.channel = std::string(protocol::name(channel));
  const protocol::ChannelLabel label = protocol::label(channel, rig.auxiliary);
  if (protocol::is_auxiliary(channel)) health.name = label.name;
  health.unit = label.unit;
  health.quality = quality_name(m);
  if (m.ever_good()) {
    health.age_s = since(m.last_good());
    health.value = m.value();
    health.rate_hz = static_cast<double>(m.all() - counted_before) / since(last_health);
  }
  counted_before = m.all();
  return health;
}

void Engine::Impl::publish_health() {
  protocol::HealthDocument health;
  health.state = std::string(name(state));
  for (int i = 0; i < protocol::kChannelCount; ++i) {
    const auto channel = static_cast<Channel>(i);
    const bool needed = channel == Channel::displacement || expects(rig, channel);
    if (needed || monitor(channel).seen()) health.channels.push_back(channel_health(channel));
  }
  health.clock = std::string(drivers::name(stamps));
  health.samples = sensor_health.samples;
  health.lost = sensor_health.lost;
  health.malformed = sensor_health.malformed;
  health.errors = sensor_health.errors;
  health.reconnects = sensor_health.reconnects;
  health.cycles_skipped = static_cast<std::uint64_t>(cycles_skipped);
  health.clients = clients;
  health.exciter_connected = status && since(status->t) < kExciterSilenceS && !exciter_error;
  health.sensor_connected = sensor_health.link_up;
  last_health = clock.now();
  publish(health);
  if (!campaign) return;
  furthest = std::max(furthest, done_s());
  publish(state_document());
}

std::optional<protocol::CycleNoiseEntry> Engine::Impl::cycle_noise() const {
  if (noise.cycles() < 2) return std::nullopt;
  protocol::CycleNoiseEntry entry;
  entry.cycles = noise.cycles();
  entry.point_m = noise.point_standard_deviation();
  entry.sensor_m = sensor_noise;
  entry.order = {"mean"};
  for (std::size_t h = 1; h < kStrokeHarmonics; ++h) {
    entry.order.push_back(fmt::format("h{}_along", h));
    entry.order.push_back(fmt::format("h{}_across", h));
  }
  for (const auto& row : noise.covariance())
    entry.covariance.insert(entry.covariance.end(), row.begin(), row.end());
  return entry;
}

double Engine::Impl::planned_s(const config::RunSpec& r) const {
  return 2.0 * ramp_s() + (kSettleGuess + r.cycles) / r.frequency_hz;
}

double Engine::Impl::done_s() const {
  double done = 0.0;
  for (std::size_t i = 0; i < run_index; ++i)
    done += planned_s(campaign->runs[i]);
  const double f = run().frequency_hz;
  if (run_done) return done + planned_s(run());
  if (state == State::settle || state == State::measure) {
    done += 2.0 * ramp_s() + static_cast<double>(run_accepted) / f;
    done += state == State::measure ? kSettleGuess / f
                                    : std::min(kSettleGuess, static_cast<double>(unsettled)) / f;
  } else if (state == State::ramp) {
    done += std::min(2.0 * ramp_s(), since(entered));
  }
  return done;
}

protocol::StateDocument Engine::Impl::state_document() const {
  protocol::StateDocument document;
  document.state = std::string(name(state));
  document.reason = reason;
  document.controlled = controlled;
  document.unprotected = rig.unprotected;
  if (!campaign) return document;
  document.campaign = campaign->name;
  document.run = run().name;
  document.run_index = static_cast<int>(run_index);
  document.run_count = static_cast<int>(campaign->runs.size());
  document.frequency_hz = setpoint.frequency_hz;
  document.amplitude = asked;
  double planned = 0.0;
  for (const auto& r : campaign->runs)
    planned += planned_s(r);
  const double done = std::min(planned, std::max(furthest, done_s()));
  document.progress = done / planned;
  if (state == State::idle || state == State::fault) {
    document.eta_s = 0.0;
  } else if (state == State::ramp_down) {
    document.eta_s = std::max(0.0, ramp_s() - since(entered));
  } else {
    document.eta_s = planned - done + ramp_s();
  }
  return document;
}

}  // namespace shaker::daemon
