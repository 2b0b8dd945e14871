// The simulated rig in this process, behind the two ports.
//
// A test that injects faults or needs the true state creates the rig itself:
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

// `read` returns the samples up to clock.now(). Without samples it sleeps on the clock until
// the next one is due or the timeout is over; on a SimulatedClock this advances the time.
class SimulatedSensor final : public Sensor {
 public:
  // `auxiliary`: the channels of the rig's auxiliary quantities, in the same order.
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

// Makes the virtual rig of a rig file. Its dead-man timeout is five heartbeat periods, at least
// 0.5 s and at most deadman_max_s. An Error names an invalid option.
Result<std::shared_ptr<SimulatedRig>> make_simulated_rig(const config::SimulatedSensor& sensor,
                                                         const config::ExciterConfig& exciter,
                                                         Clock& clock);

}  // namespace shaker::drivers::sim
