#include "drivers/can/can_sensor.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>

#include <fmt/format.h>

#include "drivers/can/can_socket.hpp"
#include "drivers/can/dbc_file.hpp"
#include "drivers/can/receiver.hpp"
#include "drivers/can/stamps.hpp"

namespace shaker::drivers::can {
namespace {

// A deleted interface reports this once, to the first reader; later its socket is only silent.
// Therefore a silence is examined.
constexpr Nanoseconds kSilence = std::chrono::seconds(1);

class CanSensor final : public Sensor {
 public:
  CanSensor(const config::CanSensor& config, FrameDecoder decoder, const Clock& clock)
      : config_(config),
        clock_(clock),
        receiver_(std::move(decoder), config.interface, config.canopen) {}

  std::string description() const override;
  std::vector<protocol::Channel> channels() const override {
    return receiver_.decoder().channels();
  }
  StampSource stamp_source() const override { return StampSource::kernel_receive; }
  Result<void> connect() override;
  Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) override;
  SensorHealth health() const override { return receiver_.health(); }

 private:
  Result<void> take_batch(Block& block, Nanoseconds wait);
  void note_losses(Nanoseconds now);
  void send_due(Nanoseconds now);
  Error lost_link(const Error& error);

  config::CanSensor config_;
  const Clock& clock_;
  Receiver receiver_;
  StampConverter stamps_;
  std::optional<CanSocket> socket_;
  std::array<Received, CanSocket::kBatch> batch_;
  std::uint64_t dropped_before_ = 0, replaced_before_ = 0;
  Nanoseconds heard_{};  // time of the last frame, or of the last examination of its silence
  bool hardware_stamps_ = false;
};

std::string CanSensor::description() const {
  return fmt::format(
      "CAN {}{}{}{}", config_.interface, config_.fd ? ", FD" : "",
      config_.canopen ? fmt::format(", CANopen node {}", config_.canopen->node_id) : "",
      hardware_stamps_ ? ", the adapter has a stamping clock of its own" : "");
}

Result<void> CanSensor::connect() {
  socket_.reset();
  CanSocket::Options options;
  options.interface = config_.interface;
  options.identifiers = receiver_.decoder().identifiers();
  options.fd = config_.fd;
  if (auto* node = receiver_.canopen()) {
    for (const auto& identifier : node->identifiers())
      options.identifiers.push_back(identifier);
  }
  auto opened = CanSocket::open(options);
  if (!opened) return lost_link(opened.error());
  socket_.emplace(std::move(*opened));
  dropped_before_ = 0;
  const auto now = clock_.now();
  heard_ = now;
  stamps_.restart(read_pair(clock_));
  receiver_.connected(now);
  if (!socket_->shortcoming().empty()) receiver_.trouble(socket_->shortcoming(), now);
  send_due(now);
  return {};
}

Error CanSensor::lost_link(const Error& error) {
  receiver_.disconnected(error.what);
  socket_.reset();
  return error;
}

// A full send queue is reported, but measurements may still arrive, so the link is kept.
void CanSensor::send_due(Nanoseconds now) {
  auto* node = receiver_.canopen();
  protocol::can::Frame frame;
  while (node != nullptr && node->next_to_send(now, frame)) {
    const auto sent = socket_->send(frame);
    if (sent) continue;
    receiver_.count_error();
    receiver_.trouble(sent.error().what, now);
  }
}

Result<void> CanSensor::take_batch(Block& block, Nanoseconds wait) {
  const std::size_t most =
      std::min(block.room() / receiver_.decoder().most_samples(), batch_.size());
  const auto got = socket_->receive(std::span(batch_).first(most), wait);
  if (!got) return got.error();
  if (*got == 0) return {};
  const ClockPair pair = read_pair(clock_);
  stamps_.update(pair);
  heard_ = pair.monotonic;
  note_losses(pair.monotonic);
  for (std::size_t i = 0; i < *got; ++i) {
    hardware_stamps_ |= batch_[i].hardware;
    receiver_.take(batch_[i].frame, stamps_.convert(batch_[i].utc), block);
  }
  return {};
}

void CanSensor::note_losses(Nanoseconds now) {
  if (socket_->dropped() != dropped_before_) {
    receiver_.count_dropped(socket_->dropped() - dropped_before_);
    receiver_.trouble(
        "frames were lost because the receive queue was full: this process was paused for too long",
        now);
    dropped_before_ = socket_->dropped();
  }
  if (stamps_.replaced() != replaced_before_) {
    receiver_.trouble(
        "frames came with no or an implausible kernel stamp and carry the time of reading: was the "
        "wall clock set?",
        now);
    replaced_before_ = stamps_.replaced();
  }
}

Result<std::size_t> CanSensor::read(std::span<Sample> out, Nanoseconds timeout) {
  if (!socket_) {
    return Error{ErrorKind::unavailable,
                 fmt::format("{} is not open: connect() first", config_.interface)};
  }
  if (out.size() < receiver_.decoder().most_samples()) {
    return Error{ErrorKind::invalid,
                 fmt::format("{}: a frame holds {} samples, there is room for {}",
                             config_.interface, receiver_.decoder().most_samples(), out.size())};
  }
  Block block{out, 0};
  auto now = clock_.now();
  const auto deadline = now + timeout;
  do {
    send_due(now);
    auto wake = std::min(deadline, heard_ + kSilence);
    if (const auto* node = receiver_.canopen()) wake = std::min(wake, node->next_deadline());
    const auto taken = take_batch(block, wake - now);
    now = clock_.now();
    if (!taken) return lost_link(taken.error());
    if (now - heard_ >= kSilence) {
      heard_ = now;
      if (!socket_->still_there()) return lost_link(link_error(ENODEV, config_.interface));
    }
  } while (block.count == 0 && now < deadline);
  receiver_.look_at_silence(now);
  send_due(now);  // starts a node at once that has just booted
  return block.count;
}

}  // namespace

Result<std::unique_ptr<Sensor>> make_can_sensor(const config::CanSensor& config,
                                                const std::filesystem::path& directory,
                                                const Clock& clock) {
  auto database = load_dbc(directory / config.dbc);
  if (!database) return database.error();
  auto decoder = FrameDecoder::make(std::move(*database), config.signals);
  if (!decoder) return decoder.error();
  if (decoder->longest_message() > protocol::can::kMaxClassicLength && !config.fd) {
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: a wanted message has {} bytes, more than a classic CAN frame's 8: add "
                    "\"fd\": true to the CAN sensor",
                    config.dbc.string(), decoder->longest_message())};
  }
  return std::unique_ptr<Sensor>(std::make_unique<CanSensor>(config, std::move(*decoder), clock));
}

}  // namespace shaker::drivers::can
