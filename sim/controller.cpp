#include "sim/controller.hpp"

namespace shaker::sim {
namespace {

// NaN gives false.
bool within(double value, double highest) {
  return value >= 0.0 && value <= highest;
}

}  // namespace

Controller::Controller(TableMotion table, double heartbeat_timeout_s) : table_(table) {
  settings_.heartbeat_timeout_s = heartbeat_timeout_s;
}

// Starts a ramp from the present motion of the table to the settings.
void Controller::follow(double now) {
  if (!settings_.enable) return;
  table_.go_to(now, settings_.frequency_hz, settings_.amplitude, settings_.ramp_s);
}

bool Controller::set_frequency(double hz, double now) {
  if (!within(hz, kHighestFrequency)) return false;
  if (hz == settings_.frequency_hz) return true;
  settings_.frequency_hz = hz;
  follow(now);
  return true;
}

bool Controller::set_amplitude(double m_s2, double now) {
  if (!within(m_s2, kHighestAmplitude)) return false;
  if (m_s2 == settings_.amplitude) return true;
  settings_.amplitude = m_s2;
  follow(now);
  return true;
}

bool Controller::set_ramp(double seconds) {
  if (!within(seconds, kLongestRamp)) return false;
  settings_.ramp_s = seconds;
  return true;
}

bool Controller::set_heartbeat_timeout(double seconds, double now) {
  if (!within(seconds, kLongestHeartbeatTimeout)) return false;
  settings_.heartbeat_timeout_s = seconds;
  last_beat_ = now;
  return true;
}

// After a fault the client must disable before it can enable: a client that keeps writing 1
// does not restart the motion.
bool Controller::set_enable(bool on, double now) {
  if (!on) {
    if (settings_.enable) table_.stop(now);
    settings_.enable = false;
    acknowledged_ = true;
    if (fault_ == FaultCode::heartbeat_lost) fault_ = FaultCode::none;
    return true;
  }
  if (settings_.enable) return true;
  if (fault_ != FaultCode::none && !acknowledged_) return false;
  fault_ = FaultCode::none;
  settings_.enable = true;
  last_beat_ = now;
  follow(now);
  return true;
}

// A client that hangs may repeat its last frame. Therefore only a new counter is a sign of
// life.
void Controller::heartbeat(std::uint32_t counter, double now) {
  if (counter == settings_.heartbeat) return;
  settings_.heartbeat = counter;
  last_beat_ = now;
}

void Controller::trip(FaultCode code, double now) {
  if (fault_ == FaultCode::none) fault_ = code;
  settings_.enable = false;
  acknowledged_ = false;
  table_.stop(now);
}

double Controller::deadline() const {
  if (!settings_.enable || settings_.heartbeat_timeout_s == 0.0) {
    return std::numeric_limits<double>::infinity();
  }
  return last_beat_ + settings_.heartbeat_timeout_s;
}

RigStatus Controller::status(double now) const {
  RigStatus status;
  status.frequency_hz = table_.frequency(now);
  status.amplitude = table_.amplitude(now);
  status.ready = fault_ == FaultCode::none;
  status.running = settings_.enable && (status.amplitude > 0.0 || table_.target_amplitude() > 0.0);
  status.fault = static_cast<std::uint32_t>(fault_);
  return status;
}

}  // namespace shaker::sim
