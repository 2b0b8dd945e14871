#include "drivers/can/can_exciter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "drivers/can/bus_watch.hpp"
#include "drivers/can/can_socket.hpp"
#include "drivers/can/dbc_file.hpp"
#include "drivers/can/dead_man.hpp"
#include "drivers/can/exciter_codec.hpp"
#include "drivers/can/stamps.hpp"
#include "protocol/can/error_frame.hpp"

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;
using protocol::can::Frame;

constexpr double kHeartbeatsMissed = 3.0;
constexpr int kMostBatches = 64;              // in one examination of the bus, which may be flooded
constexpr Nanoseconds kForeignAgain = 500ms;  // between two Errors about another node's setpoints
constexpr Nanoseconds kLeastReturn = 100ms;   // a frame of ours is on the bus within this time

bool at_rest(const Setpoint& setpoint) {
  return !setpoint.enable || setpoint.amplitude == 0.0;
}

// Number of frames after which the kernel stops: three heartbeat periods.
unsigned frames_until_silence(double heartbeat_period_s, double period_s) {
  return static_cast<unsigned>(
      std::max(2.0, std::round(kHeartbeatsMissed * heartbeat_period_s / period_s)));
}

class CanExciter final : public Exciter {
 public:
  CanExciter(const config::CanExciter& config, double heartbeat_period_s, ExciterCodec codec,
             const Clock& clock)
      : config_(config),
        period_(from_seconds(config.period_s)),
        count_(frames_until_silence(heartbeat_period_s, config.period_s)),
        codec_(std::move(codec)),
        clock_(clock),
        bus_(period_, codec_.status_period_s()) {}

  std::string description() const override {
    return fmt::format("CAN {}, {} every {} ms, at most {} times", config_.interface,
                       config_.setpoint_message, config_.period_s * 1e3, count_);
  }
  Result<void> connect() override;
  Result<void> write(const Setpoint& setpoint) override;
  Result<ExciterStatus> read() override;
  Result<void> heartbeat() override;
  Result<void> stop() override;

 private:
  struct Link {
    DeadMan dead_man;
    CanSocket bus;  // the drive's status, and the setpoints of any node
  };
  Result<void> look_for_expiry();
  Result<void> arm();
  Result<void> look_at_bus(Nanoseconds wait);
  Result<void> take(const Received& received);
  Result<void> take_error(const Frame& frame);
  Result<void> judge_bus();
  Result<void> await_return();
  Error lost_link(const Error& error);
  void nothing_is_sent();
  bool moving() const { return armed_ && !at_rest(*armed_); }

  config::CanExciter config_;
  Nanoseconds period_;
  unsigned count_;
  ExciterCodec codec_;
  const Clock& clock_;
  std::optional<Link> link_;
  StampConverter stamps_;
  std::optional<Setpoint> armed_;  // what the kernel sends or was sending
  bool expired_ = false;           // the kernel stopped while motion was commanded
  std::uint64_t counter_ = 0;
  std::optional<ExciterStatus> status_;
  std::optional<ExciterStatus> fault_;  // the first one since the last read()
  BusWatch bus_;
  bool foreign_ = false;  // another node sends our setpoint's identifier; not yet reported
  Nanoseconds foreign_said_{};
  std::array<Received, CanSocket::kBatch> batch_;
};

Result<void> CanExciter::connect() {
  link_.reset();  // closing the broadcast manager's socket ends its sending
  status_.reset();
  fault_.reset();
  nothing_is_sent();
  auto dead_man = DeadMan::open(config_.interface);
  if (!dead_man) return dead_man.error();
  CanSocket::Options options;
  options.interface = config_.interface;
  options.identifiers = {codec_.status_identifier(), codec_.setpoint_identifier()};
  options.receive_buffer = 256 << 10;
  auto bus = CanSocket::open(options);
  if (!bus) return bus.error();
  link_.emplace(Link{std::move(*dead_man), std::move(*bus)});
  stamps_.restart(read_pair(clock_));
  return {};
}

Error CanExciter::lost_link(const Error& error) {
  link_.reset();
  nothing_is_sent();
  return error;
}

void CanExciter::nothing_is_sent() {
  if (moving()) expired_ = true;
  armed_.reset();
  bus_.silent(clock_.now());
}

Result<void> CanExciter::look_for_expiry() {
  if (!link_) {
    return Error{ErrorKind::unavailable,
                 fmt::format("the CAN exciter on {} is not connected", config_.interface)};
  }
  const auto expired = link_->dead_man.expired();
  if (!expired) return lost_link(expired.error());
  if (*expired) nothing_is_sent();
  return {};
}

Result<void> CanExciter::arm() {
  const auto frame = codec_.setpoint(*armed_, ++counter_);
  if (!frame) return frame.error();
  bus_.sending(*frame, clock_.now());
  if (auto done = link_->dead_man.arm(*frame, period_, count_); !done)
    return lost_link(done.error());
  if (auto held = link_->dead_man.verify(*frame); !held) return lost_link(held.error());
  return {};
}

Result<void> CanExciter::write(const Setpoint& setpoint) {
  if (const auto encodable = codec_.setpoint(setpoint, counter_); !encodable)
    return encodable.error();
  if (auto looked = look_for_expiry(); !looked) return looked.error();
  if (at_rest(setpoint)) {
    expired_ = false;
  } else if (expired_) {
    return Error{
        ErrorKind::refused,
        fmt::format(
            "CAN exciter on {}: the setpoint frames had stopped by themselves; write amplitude "
            "zero first, motion does not resume by itself",
            config_.interface)};
  }
  armed_ = setpoint;
  return arm();
}

Result<void> CanExciter::heartbeat() {
  if (auto looked = look_for_expiry(); !looked) return looked.error();
  if (expired_) {
    return Error{
        ErrorKind::refused,
        fmt::format(
            "CAN exciter on {}: no heartbeat for {:.0f} ms, so that the setpoint frames have "
            "stopped; start again from amplitude zero",
            config_.interface, config_.period_s * 1e3 * count_)};
  }
  if (!armed_) return {};
  return arm();
}

// Takes all frames that are there, because an old frame in the queue is not the current status.
Result<void> CanExciter::look_at_bus(Nanoseconds wait) {
  Result<void> all_good;
  for (int i = 0; i < kMostBatches; ++i) {
    const auto got = link_->bus.receive(batch_, i == 0 ? wait : Nanoseconds{0});
    if (!got) return lost_link(got.error());
    if (*got == 0) break;
    stamps_.update(read_pair(clock_));
    for (const Received& received : std::span(batch_).first(*got)) {
      if (received.frame.error) {
        if (auto well = take_error(received.frame); !well) return well;
      } else if (auto taken = take(received); !taken) {
        all_good = taken;
      }
    }
    if (*got < batch_.size()) break;
  }
  return all_good;
}

Result<void> CanExciter::take(const Received& received) {
  const Nanoseconds t = stamps_.convert(received.utc);
  if (codec_.is_setpoint(received.frame)) {
    const bool matters = moving() || codec_.commands_motion(received.frame);
    if (!bus_.is_ours(received.frame, t) && matters) foreign_ = true;
    return {};
  }
  if (!codec_.is_status(received.frame)) return {};
  bus_.on_status(t);
  const auto status = codec_.status(received.frame, t);
  if (!status) return status.error();
  status_ = *status;
  if (status->fault != 0 && !fault_) fault_ = *status;
  return {};
}

// After bus-off, frames that wait in the controller's queue must not cause motion later.
Result<void> CanExciter::take_error(const Frame& frame) {
  if (!protocol::can::interpret_error(frame).bus_off) return {};
  std::string sentence;
  protocol::can::describe_error(frame, config_.interface, sentence);
  return lost_link(Error{ErrorKind::unavailable, sentence});
}

Result<void> CanExciter::judge_bus() {
  const Nanoseconds now = clock_.now();
  if (foreign_ && (foreign_said_.count() == 0 || now - foreign_said_ >= kForeignAgain)) {
    foreign_ = false;
    foreign_said_ = now;
    return Error{
        ErrorKind::refused,
        fmt::format("{}: another node sends {} too, and the drive may follow that one: find the "
                    "node and take it off the bus",
                    config_.interface, config_.setpoint_message)};
  }
  if (bus_.unheard(now)) {
    return Error{
        ErrorKind::exhausted,
        fmt::format("{}: the setpoint frames do not get onto the bus: the send queue is full, "
                    "nobody acknowledges, or another node fills the bus; check the wiring, the bit "
                    "rate and the other nodes",
                    config_.interface)};
  }
  if (bus_.two_senders()) {
    return Error{
        ErrorKind::refused,
        fmt::format("{}: {} comes much more often than {} states, so that two nodes may send it: "
                    "find the other one and take it off the bus, or correct the message's cycle "
                    "time",
                    config_.interface, config_.status_message, config_.dbc.string())};
  }
  return {};
}

Result<ExciterStatus> CanExciter::read() {
  if (auto looked = look_for_expiry(); !looked) return looked.error();
  const auto limit = codec_.status_limit();
  const auto started = clock_.now();
  bool looked_before = false;
  for (auto now = started;; now = clock_.now()) {
    const bool fresh = status_ && now - status_->t <= limit;
    const auto left = started + limit - now;
    if (auto taken = look_at_bus(fresh ? Nanoseconds{0} : left); !taken) return taken.error();
    const auto after = clock_.now();
    if (!std::exchange(looked_before, true) || after - started >= limit) {
      if (auto well = judge_bus(); !well) return well.error();
    }
    if (fault_) return *std::exchange(fault_, std::nullopt);
    if (status_ && after - status_->t <= limit) return *status_;
    if (after - started >= limit) {
      return Error{
          ErrorKind::timeout,
          fmt::format(
              "CAN exciter on {}: no status message {} for {:.0f} ms; is the drive powered and on "
              "this bus?",
              config_.interface, config_.status_message, seconds(limit) * 1e3)};
    }
  }
}

// The frame at rest replaces the other one in the kernel and is sent at once, `count_` times in
// total. The kernel takes it even if its queue is full, so only a frame that returns has been
// sent.
Result<void> CanExciter::stop() {
  const Setpoint rest{};
  if (link_ && write(rest)) return await_return();
  if (auto again = connect(); !again) {
    return Error{
        again.error().kind,
        fmt::format(
            "the stop could not be sent: {}; setpoint frames end by themselves {:.0f} ms after the "
            "last heartbeat",
            again.error().what, config_.period_s * 1e3 * count_)};
  }
  if (auto written = write(rest); !written) return written;
  return await_return();
}

Result<void> CanExciter::await_return() {
  const Nanoseconds limit = std::max(kLeastReturn, 3 * period_);
  const Nanoseconds started = clock_.now();
  for (Nanoseconds now = started; !bus_.heard(); now = clock_.now()) {
    if (now - started > limit) {
      return Error{
          ErrorKind::exhausted,
          fmt::format("{}: the stop does not get onto the bus: the send queue is full, nobody "
                      "acknowledges, or another node fills the bus; the drive stops by itself "
                      "where its dead-man is on",
                      config_.interface)};
    }
    if (auto looked = look_at_bus(started + limit - now); !looked && !link_) return looked;
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Exciter>> make_can_exciter(const config::CanExciter& config,
                                                  double heartbeat_period_s,
                                                  const std::filesystem::path& directory,
                                                  const Clock& clock) {
  if (!(config.period_s >= 0.001 && config.period_s <= 1.0)) {
    return Error{
        ErrorKind::invalid,
        fmt::format("CAN exciter: period_s is {}, allowed is 0.001 to 1", config.period_s)};
  }
  const auto database = load_dbc(directory / config.dbc);
  if (!database) return database.error();
  auto codec = ExciterCodec::make(*database, config);
  if (!codec) return codec.error();
  if (const auto rest = codec->setpoint(Setpoint{}, 0); !rest) {
    return Error{
        ErrorKind::invalid,
        fmt::format(
            "{}: message {} cannot say 'stop': {}; widen the signal's range to include zero",
            config.dbc.string(), config.setpoint_message, rest.error().what)};
  }
  return std::unique_ptr<Exciter>(
      std::make_unique<CanExciter>(config, heartbeat_period_s, std::move(*codec), clock));
}

}  // namespace shaker::drivers::can
