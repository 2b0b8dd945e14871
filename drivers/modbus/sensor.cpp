#include "drivers/modbus/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "drivers/modbus/connection.hpp"
#include "drivers/modbus/device_clock.hpp"
#include "drivers/modbus/register_set.hpp"

namespace shaker::drivers::modbus {
namespace {

using protocol::Channel;
using protocol::modbus::RegisterSpec;
using protocol::modbus::RegisterType;

class ModbusSensor final : public Sensor {
 public:
  ModbusSensor(double rate_hz, Clock& clock, std::unique_ptr<ModbusConnection> connection,
               std::vector<Channel> channels, std::vector<RegisterSpec> specs,
               std::optional<DeviceClock> device_clock)
      : clock_(clock),
        period_(from_seconds(1.0 / rate_hz)),
        connection_(std::move(connection)),
        channels_(std::move(channels)),
        registers_(std::move(specs)),
        device_clock_(std::move(device_clock)) {}

  std::string description() const override { return connection_->description(); }
  std::vector<Channel> channels() const override { return channels_; }
  StampSource stamp_source() const override {
    return device_clock_ ? StampSource::device : StampSource::host_receive;
  }
  Result<void> connect() override;
  Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) override;
  SensorHealth health() const override { return health_; }

 private:
  void skip_missed(Nanoseconds now);
  std::optional<Nanoseconds> stamp(Nanoseconds asked, Nanoseconds received);
  void note(const Error& error);

  Clock& clock_;
  const Nanoseconds period_;
  std::unique_ptr<ModbusConnection> connection_;
  const std::vector<Channel> channels_;
  RegisterSet registers_;                    // the channels', and at last the time stamp's
  std::optional<DeviceClock> device_clock_;  // when there is a time stamp
  Nanoseconds due_{0};
  SensorHealth health_;
};

Result<void> ModbusSensor::connect() {
  const Result<void> connected = connection_->connect();
  health_.link_up = connected.ok();
  if (!connected) {
    health_.trouble = connected.error().what;
    return connected;
  }
  const std::uint64_t connects = connection_->counters().connects;
  health_.reconnects = connects - 1;
  health_.trouble.clear();
  due_ = clock_.now();
  if (device_clock_) device_clock_->restart();
  return {};
}

// nullopt: the device has taken no sample since the last poll.
std::optional<Nanoseconds> ModbusSensor::stamp(Nanoseconds asked, Nanoseconds received) {
  if (!device_clock_) return asked + (received - asked) / 2;
  return device_clock_->stamp(registers_.bits(channels_.size()), asked, received);
}

// A poll that is more than a period late is left out: two in a hurry would say nothing new.
void ModbusSensor::skip_missed(Nanoseconds now) {
  if (now < due_ + period_) return;
  const auto missed = (now - due_) / period_;
  health_.lost += static_cast<std::uint64_t>(missed) * channels_.size();
  due_ += missed * period_;
}

void ModbusSensor::note(const Error& error) {
  ++health_.errors;
  health_.malformed = connection_->counters().malformed;
  health_.trouble = error.what;
  health_.link_up = connection_->connected();
}

Result<std::size_t> ModbusSensor::read(std::span<Sample> out, Nanoseconds timeout) {
  if (!connection_->connected()) {
    return Error{ErrorKind::unavailable, description() + ": not connected"};
  }
  if (out.size() < channels_.size()) {
    return Error{ErrorKind::invalid, fmt::format("{}: {} channels do not fit into room for {}",
                                                 description(), channels_.size(), out.size())};
  }
  const Nanoseconds latest = clock_.now() + timeout;
  if (due_ > latest) {
    clock_.sleep_until(latest);
    return std::size_t{0};
  }
  clock_.sleep_until(due_);
  skip_missed(clock_.now());
  due_ += period_;

  const Nanoseconds asked = clock_.now();
  if (const Result<void> done = registers_.read(*connection_); !done) {
    note(done.error());
    if (connection_->connected()) return std::size_t{0};
    return done.error();
  }
  health_.trouble.clear();
  const std::optional<Nanoseconds> taken = stamp(asked, clock_.now());
  if (!taken) return std::size_t{0};
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const double value = registers_.value(i);
    out[i] = {*taken, value, channels_[i], std::isfinite(value) ? Quality::good : Quality::bad};
  }
  health_.samples += channels_.size();
  return channels_.size();
}

Error wrong(const std::string& text) {
  return Error{ErrorKind::invalid, text};
}

// Wraps are told from missed polls by our own clock, which must not need to be better than this.
constexpr double kShortestRangeNs = 2e9;

Result<DeviceClock> make_device_clock(const RegisterSpec& spec) {
  if (const Result<void> good = protocol::modbus::validate(spec); !good) {
    return wrong(fmt::format("registers.timestamp: {}", good.error().what));
  }
  if (spec.type != RegisterType::u16 && spec.type != RegisterType::u32) {
    return wrong("registers.timestamp: the type must be u16 or u32");
  }
  const double unit_ns = spec.unit == "us"   ? 1e3
                         : spec.unit == "ms" ? 1e6
                         : spec.unit == "s"  ? 1e9
                                             : 0.0;
  if (unit_ns == 0.0 || spec.scale < 0.0) {
    return wrong(
        fmt::format("registers.timestamp: unit \"{}\" must be us, ms or s, scale {} above 0",
                    spec.unit, spec.scale));
  }
  const DeviceClock::Counter counter{16 * protocol::modbus::word_count(spec.type),
                                     unit_ns * spec.scale};
  const double range_ns = std::ldexp(counter.tick_ns, counter.bits);
  if (range_ns < kShortestRangeNs) {
    return wrong(
        fmt::format("registers.timestamp: it wraps every {:.3g} s, at least {:g} s are "
                    "needed to tell a wrap from missed polls; leave it out",
                    range_ns * 1e-9, kShortestRangeNs * 1e-9));
  }
  return DeviceClock(counter);
}

}  // namespace

Result<std::unique_ptr<Sensor>> make_sensor(const config::ModbusSensor& config, Clock& clock) {
  if (config.registers.empty()) return wrong("registers: at least one channel is needed");
  if (!(config.rate_hz > 0.0 && config.rate_hz <= 10000.0)) {
    return wrong(fmt::format("rate_hz {} must be above 0 and at most 10000", config.rate_hz));
  }
  std::vector<Channel> channels;
  std::vector<RegisterSpec> specs;
  for (const auto& [channel, spec] : config.registers) {
    if (const Result<void> good = protocol::modbus::validate(spec); !good) {
      return wrong(fmt::format("registers.{}: {}", protocol::name(channel), good.error().what));
    }
    channels.push_back(channel);
    specs.push_back(spec);
  }
  std::optional<DeviceClock> device_clock;
  if (config.timestamp) {
    const Result<DeviceClock> made = make_device_clock(*config.timestamp);
    if (!made) return made.error();
    device_clock = *made;
    specs.push_back(*config.timestamp);
    if (protocol::modbus::plan_reads(specs).blocks.size() != 1) {
      return wrong(
          "registers.timestamp: it is not read in one request with all channels, so it could be of "
          "another sample; take registers without a hole between them, or leave it out");
    }
  }
  auto connection = ModbusConnection::make(config.link, clock);
  if (!connection) return connection.error();
  return std::unique_ptr<Sensor>(
      std::make_unique<ModbusSensor>(config.rate_hz, clock, std::move(*connection),
                                     std::move(channels), std::move(specs), device_clock));
}

}  // namespace shaker::drivers::modbus
