#include "drivers/sim/simulated_devices.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace shaker::drivers::sim {
namespace {

using shaker::sim::Fault;
using shaker::sim::RigOptions;
using shaker::sim::RigSettings;
using shaker::sim::VirtualRig;

Error silent() {
  return {ErrorKind::timeout,
          "the simulated exciter does not answer (fault exciter_silent is injected)"};
}

Error refused(const VirtualRig& rig, const Setpoint& setpoint) {
  if (const auto fault = rig.status().fault; setpoint.enable && fault != 0) {
    return {ErrorKind::refused,
            fmt::format("the simulated exciter is stopped by its fault {}: disable it, and enable "
                        "it again",
                        fault)};
  }
  return {ErrorKind::refused,
          fmt::format("the simulated exciter refuses {} Hz, {} m/s^2, ramp {} s: at most {} Hz, {} "
                      "m/s^2, {} s, and none negative",
                      setpoint.frequency_hz, setpoint.amplitude, setpoint.ramp_s,
                      shaker::sim::kHighestFrequency, shaker::sim::kHighestAmplitude,
                      shaker::sim::kLongestRamp)};
}

}  // namespace

std::string SimulatedExciter::description() const {
  return fmt::format("simulated exciter (plant {})", rig_->options().plant);
}

Result<void> SimulatedExciter::connect() {
  return rig_->at_now([](VirtualRig& rig) -> Result<void> {
    if (rig.injected() == Fault::exciter_silent) return silent();
    return {};
  });
}

Result<void> SimulatedExciter::write(const Setpoint& setpoint) {
  return rig_->at_now([&](VirtualRig& rig) -> Result<void> {
    if (rig.injected() == Fault::exciter_silent) return silent();
    // Disables first and enables last, so that nothing moves on an incomplete setpoint.
    if (!setpoint.enable) rig.set_enable(false);
    const bool taken = rig.set_ramp(setpoint.ramp_s) && rig.set_frequency(setpoint.frequency_hz) &&
                       rig.set_amplitude(setpoint.amplitude) &&
                       (!setpoint.enable || rig.set_enable(true));
    if (!taken) return refused(rig, setpoint);
    return {};
  });
}

Result<ExciterStatus> SimulatedExciter::read() {
  return rig_->at_now([&](VirtualRig& rig) -> Result<ExciterStatus> {
    if (rig.injected() == Fault::exciter_silent) return silent();
    const auto now = rig.status();
    ExciterStatus status;
    status.t = rig_->clock().now();
    status.ready = now.ready;
    status.running = now.running;
    status.fault = now.fault;
    status.frequency_hz = now.frequency_hz;
    status.amplitude = now.amplitude;
    status.heartbeat_timeout_s = rig.settings().heartbeat_timeout_s;
    return status;
  });
}

Result<void> SimulatedExciter::heartbeat() {
  return rig_->at_now([&](VirtualRig& rig) -> Result<void> {
    if (rig.injected() == Fault::exciter_silent) return silent();
    rig.heartbeat(++beat_);
    return {};
  });
}

Result<void> SimulatedExciter::stop() {
  return rig_->at_now([](VirtualRig& rig) -> Result<void> {
    if (rig.injected() == Fault::exciter_silent) return silent();
    rig.set_enable(false);
    rig.set_amplitude(0.0);
    return {};
  });
}

SimulatedSensor::SimulatedSensor(std::shared_ptr<SimulatedRig> rig,
                                 std::span<const protocol::Channel> auxiliary)
    : rig_(std::move(rig)),
      channels_{protocol::Channel::displacement, protocol::Channel::excitation} {
  for (const auto channel : auxiliary)
    channels_.push_back(channel);
  taken_.reserve(SimulatedRig::kQueue);
}

std::string SimulatedSensor::description() const {
  return fmt::format("simulated sensors (plant {}, {} Hz)", rig_->options().plant,
                     rig_->options().sample_rate_hz);
}

std::vector<protocol::Channel> SimulatedSensor::channels() const {
  return channels_;
}

Result<void> SimulatedSensor::connect() {
  rig_->discard();
  health_.reconnects += health_.link_up ? 1 : 0;
  health_.link_up = true;
  return {};
}

std::size_t SimulatedSensor::drain(std::span<Sample> out) {
  rig_->take(taken_, std::min(out.size() / channels_.size(), SimulatedRig::kQueue));
  std::size_t n = 0;
  for (const auto& sample : taken_) {
    if (sample.dropped) {
      ++health_.lost;
      continue;
    }
    const auto put = [&](double value, protocol::Channel channel) {
      out[n++] = {sample.t, value, channel, std::isfinite(value) ? Quality::good : Quality::bad};
    };
    put(sample.displacement, protocol::Channel::displacement);
    put(sample.excitation, protocol::Channel::excitation);
    for (std::size_t i = 2; i < channels_.size(); ++i)
      put(sample.auxiliary[i - 2], channels_[i]);
  }
  health_.samples += n;
  return n;
}

Result<std::size_t> SimulatedSensor::read(std::span<Sample> out, Nanoseconds timeout) {
  Clock& clock = rig_->clock();
  const Nanoseconds deadline = clock.now() + timeout;
  while (true) {
    const std::size_t n = drain(out);
    if (n > 0 || clock.now() >= deadline) return n;
    clock.sleep_until(std::min(deadline, rig_->next_sample()));
  }
}

SensorHealth SimulatedSensor::health() const {
  SensorHealth health = health_;
  health.lost += rig_->overwritten();
  return health;
}

Result<std::shared_ptr<SimulatedRig>> make_simulated_rig(const config::SimulatedSensor& sensor,
                                                         const config::ExciterConfig& exciter,
                                                         Clock& clock) {
  RigOptions options;
  options.plant = sensor.plant;
  options.parameters = sensor.parameters;
  options.sample_rate_hz = sensor.rate_hz;
  options.noise_m = sensor.noise_m;
  options.noise_m_s2 = sensor.noise_m_s2;
  options.quantum_m = sensor.quantum_m;
  options.clock_offset_ppm = sensor.clock_offset_ppm;
  options.jitter_fraction = sensor.jitter_fraction;
  options.dropout_fraction = sensor.dropout_fraction;
  options.seed = sensor.seed;
  for (const auto& [channel, quantity] : sensor.auxiliary)
    options.auxiliary.push_back(quantity);
  options.heartbeat_timeout_s =
      std::min(exciter.deadman_max_s, std::max(0.5, 5.0 * exciter.heartbeat_period_s));
  try {
    return std::make_shared<SimulatedRig>(options, clock);
  } catch (const std::invalid_argument& error) {
    return Error{ErrorKind::invalid, std::string("simulated rig: ") + error.what()};
  }
}

}  // namespace shaker::drivers::sim
