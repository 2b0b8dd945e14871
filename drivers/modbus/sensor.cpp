#include "drivers/modbus/sensor.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "drivers/modbus/connection.hpp"
#include "drivers/modbus/poll_decoder.hpp"
#include "drivers/modbus/poll_recorder.hpp"

namespace shaker::drivers::modbus {
namespace {

using protocol::Channel;

class ModbusSensor final : public Sensor {
 public:
  ModbusSensor(double rate_hz, Clock& clock, std::unique_ptr<ModbusConnection> connection,
               PollDecoder decoder, PollRecorder recorder)
      : clock_(clock),
        period_(from_seconds(1.0 / rate_hz)),
        connection_(std::move(connection)),
        decoder_(std::move(decoder)),
        recorder_(std::move(recorder)) {}

  std::string description() const override { return connection_->description(); }
  std::vector<Channel> channels() const override { return decoder_.channels(); }
  StampSource stamp_source() const override {
    return decoder_.stamped() ? StampSource::device : StampSource::host_receive;
  }
  Result<void> connect() override;
  Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) override;
  SensorHealth health() const override { return health_; }

 private:
  void skip_missed(Nanoseconds now);
  void note(const Error& error);

  Clock& clock_;
  const Nanoseconds period_;
  std::unique_ptr<ModbusConnection> connection_;
  PollDecoder decoder_;
  PollRecorder recorder_;
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
  decoder_.restart();
  recorder_.connected(due_);
  return {};
}

// A poll that is more than a period late is skipped: two polls in a row would give nothing new.
void ModbusSensor::skip_missed(Nanoseconds now) {
  if (now < due_ + period_) return;
  const auto missed = (now - due_) / period_;
  health_.lost += static_cast<std::uint64_t>(missed) * decoder_.channels().size();
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
  if (out.size() < decoder_.channels().size()) {
    return Error{ErrorKind::invalid,
                 fmt::format("{}: {} channels do not fit into room for {}", description(),
                             decoder_.channels().size(), out.size())};
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
  const Result<void> done = decoder_.registers().read(*connection_);
  const Nanoseconds received = clock_.now();
  if (!done) {
    recorder_.failed(asked, received);
    note(done.error());
    if (connection_->connected()) return std::size_t{0};
    return done.error();
  }
  recorder_.poll(asked, received, decoder_.registers());
  health_.trouble = recorder_.trouble();
  const std::size_t count = decoder_.decode(asked, received, out);
  health_.samples += count;
  return count;
}

}  // namespace

Result<std::unique_ptr<Sensor>> make_sensor(const config::ModbusSensor& config, Clock& clock,
                                            const std::filesystem::path& directory) {
  if (!(config.rate_hz > 0.0 && config.rate_hz <= 10000.0)) {
    return Error{ErrorKind::invalid,
                 fmt::format("rate_hz {} must be above 0 and at most 10000", config.rate_hz)};
  }
  auto decoder = PollDecoder::make(config.registers, config.timestamp);
  if (!decoder) return decoder.error();
  auto recorder = PollRecorder::open(config.record_to, directory);
  if (!recorder) return recorder.error();
  auto connection = ModbusConnection::make(config.link, clock);
  if (!connection) return connection.error();
  return std::unique_ptr<Sensor>(std::make_unique<ModbusSensor>(
      config.rate_hz, clock, std::move(*connection), std::move(*decoder), std::move(*recorder)));
}

}  // namespace shaker::drivers::modbus
