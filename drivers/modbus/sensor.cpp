#include "drivers/modbus/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "drivers/modbus/connection.hpp"
#include "drivers/modbus/register_set.hpp"

namespace shaker::drivers::modbus {
namespace {

using protocol::Channel;
using protocol::modbus::RegisterSpec;

class ModbusSensor final : public Sensor {
 public:
  ModbusSensor(double rate_hz, Clock& clock, std::unique_ptr<ModbusConnection> connection,
               std::vector<Channel> channels, std::vector<RegisterSpec> specs)
      : clock_(clock),
        period_(from_seconds(1.0 / rate_hz)),
        connection_(std::move(connection)),
        channels_(std::move(channels)),
        registers_(std::move(specs)) {}

  std::string description() const override { return connection_->description(); }
  std::vector<Channel> channels() const override { return channels_; }
  StampSource stamp_source() const override { return StampSource::host_receive; }
  Result<void> connect() override;
  Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) override;
  SensorHealth health() const override { return health_; }

 private:
  void skip_missed(Nanoseconds now);
  void note(const Error& error);

  Clock& clock_;
  const Nanoseconds period_;
  std::unique_ptr<ModbusConnection> connection_;
  const std::vector<Channel> channels_;
  RegisterSet registers_;
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
  return {};
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
  const Nanoseconds stamp = asked + (clock_.now() - asked) / 2;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const double value = registers_.value(i);
    out[i] = {stamp, value, channels_[i], std::isfinite(value) ? Quality::good : Quality::bad};
  }
  health_.samples += channels_.size();
  health_.trouble.clear();
  return channels_.size();
}

Error wrong(const std::string& text) {
  return Error{ErrorKind::invalid, text};
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
  auto connection = ModbusConnection::make(config.link, clock);
  if (!connection) return connection.error();
  return std::unique_ptr<Sensor>(std::make_unique<ModbusSensor>(
      config.rate_hz, clock, std::move(*connection), std::move(channels), std::move(specs)));
}

}  // namespace shaker::drivers::modbus
