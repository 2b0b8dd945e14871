#include "drivers/can/can_exciter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "drivers/can/can_socket.hpp"
#include "drivers/can/dbc_file.hpp"
#include "drivers/can/dead_man.hpp"
#include "drivers/can/exciter_codec.hpp"
#include "drivers/can/stamps.hpp"

namespace shaker::drivers::can {
namespace {

constexpr double kHeartbeatsMissed = 3.0;

bool at_rest(const Setpoint& setpoint) {
  return !setpoint.enable || setpoint.amplitude == 0.0;
}

// The last frame leaves three heartbeat periods after the first.
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
        clock_(clock) {}

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
    CanSocket status;
  };
  Result<void> look_for_expiry();
  Result<void> arm();
  Result<void> take_status(Nanoseconds wait);
  Error lost_link(const Error& error);

  config::CanExciter config_;
  Nanoseconds period_;
  unsigned count_;
  ExciterCodec codec_;
  const Clock& clock_;
  std::optional<Link> link_;
  StampConverter stamps_;
  std::optional<Setpoint> armed_;  // what the kernel sends, or was sending
  bool expired_ = false;           // it stopped while motion was commanded
  std::uint64_t counter_ = 0;
  std::optional<ExciterStatus> status_;
  std::array<Received, CanSocket::kBatch> batch_;
};

Result<void> CanExciter::connect() {
  const bool was_moving = armed_ && !at_rest(*armed_);
  link_.reset();  // closing the broadcast manager's socket ends its sending
  status_.reset();
  armed_.reset();
  if (was_moving) expired_ = true;
  auto dead_man = DeadMan::open(config_.interface);
  if (!dead_man) return dead_man.error();
  CanSocket::Options options;
  options.interface = config_.interface;
  options.identifiers = {codec_.status_identifier()};
  options.error_frames = false;  // the sensor reports them
  options.receive_buffer = 64 << 10;
  auto status = CanSocket::open(options);
  if (!status) return status.error();
  link_.emplace(Link{std::move(*dead_man), std::move(*status)});
  stamps_.restart(read_pair(clock_));
  return {};
}

Error CanExciter::lost_link(const Error& error) {
  if (armed_ && !at_rest(*armed_)) expired_ = true;
  link_.reset();
  armed_.reset();
  return error;
}

Result<void> CanExciter::look_for_expiry() {
  if (!link_) {
    return Error{ErrorKind::unavailable,
                 fmt::format("the CAN exciter on {} is not connected", config_.interface)};
  }
  const auto expired = link_->dead_man.expired();
  if (!expired) return lost_link(expired.error());
  if (!*expired) return {};
  if (armed_ && !at_rest(*armed_)) expired_ = true;
  armed_.reset();
  return {};
}

Result<void> CanExciter::arm() {
  const auto frame = codec_.setpoint(*armed_, ++counter_);
  if (!frame) return frame.error();
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

Result<void> CanExciter::take_status(Nanoseconds wait) {
  const auto got = link_->status.receive(batch_, wait);
  if (!got) return lost_link(got.error());
  if (*got == 0) return {};
  stamps_.update(read_pair(clock_));
  Result<void> all_good;
  for (std::size_t i = 0; i < *got; ++i) {
    if (!codec_.is_status(batch_[i].frame)) continue;
    const auto status = codec_.status(batch_[i].frame, stamps_.convert(batch_[i].utc));
    if (status) {
      status_ = *status;
    } else {
      all_good = status.error();
    }
  }
  return all_good;
}

Result<ExciterStatus> CanExciter::read() {
  if (auto looked = look_for_expiry(); !looked) return looked.error();
  const auto limit = codec_.status_limit();
  const auto started = clock_.now();
  for (auto now = started;; now = clock_.now()) {
    const bool fresh = status_ && now - status_->t <= limit;
    const auto left = started + limit - now;
    if (auto taken = take_status(fresh ? Nanoseconds{0} : left); !taken) return taken.error();
    const auto after = clock_.now();
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

// The frame at rest replaces the other in the kernel and goes out at once, then `count_` times in
// all.
Result<void> CanExciter::stop() {
  const Setpoint rest{};
  if (link_ && write(rest)) return {};
  if (auto again = connect(); !again) {
    return Error{
        again.error().kind,
        fmt::format(
            "the stop could not be sent: {}; setpoint frames end by themselves {:.0f} ms after the "
            "last heartbeat",
            again.error().what, config_.period_s * 1e3 * count_)};
  }
  return write(rest);
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
