// The in-process rig behind the two ports.
//
// A test that wants to inject faults or see the truth makes the rig itself and keeps it:
//
//     auto rig = std::make_shared<drivers::sim::SimulatedRig>(options, clock);
//     drivers::sim::SimulatedExciter exciter(rig);
//     drivers::sim::SimulatedSensor sensor(rig);
//     rig->at_now([](auto& r) { r.inject(shaker::sim::Fault::sensor_frozen); });
#pragma once

#include <memory>

#include "config/rig.hpp"
#include "drivers/exciter.hpp"
#include "drivers/sensor.hpp"
#include "drivers/sim/simulated_rig.hpp"

namespace shaker::drivers::sim {

class SimulatedExciter final : public Exciter {
 public:
  explicit SimulatedExciter(std::shared_ptr<SimulatedRig> rig) : rig_(std::move(rig)) {}
  std::string description() const override;
  Result<void> connect() override;
  Result<void> write(const Setpoint& setpoint) override;
  Result<ExciterStatus> read() override;
  Result<void> heartbeat() override;
  Result<void> stop() override;

 private:
  std::shared_ptr<SimulatedRig> rig_;
  std::uint32_t beat_ = 0;
};

// `read` returns what was sampled up to clock.now(). Where there is nothing yet it waits on the
// clock until the next sample is due or the timeout is over; on a SimulatedClock that moves the
// time on.
class SimulatedSensor final : public Sensor {
 public:
  // `auxiliary`: the channels of the rig's auxiliary quantities, in their order.
  explicit SimulatedSensor(std::shared_ptr<SimulatedRig> rig,
                           std::span<const protocol::Channel> auxiliary = {});
  std::string description() const override;
  std::vector<protocol::Channel> channels() const override;
  StampSource stamp_source() const override { return StampSource::simulated; }
  Result<void> connect() override;
  Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) override;
  SensorHealth health() const override;

 private:
  std::size_t drain(std::span<Sample> out);

  std::shared_ptr<SimulatedRig> rig_;
  std::vector<protocol::Channel> channels_;
  SensorHealth health_;
  std::vector<shaker::sim::RigSample> taken_;
};

// The virtual rig that a rig file describes. Its dead-man waits for five heartbeats, at least 0.5 s
// and never longer than deadman_max_s.
Result<std::shared_ptr<SimulatedRig>> make_simulated_rig(const config::SimulatedSensor& sensor,
                                                         const config::ExciterConfig& exciter,
                                                         Clock& clock);

}  // namespace shaker::drivers::sim
