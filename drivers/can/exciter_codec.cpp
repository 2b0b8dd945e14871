#include "drivers/can/exciter_codec.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/unit.hpp"

namespace shaker::drivers::can {
namespace {

using protocol::can::Database;
using protocol::can::Frame;
using protocol::can::Message;

Result<Message> find_message(const Database& database, const std::string& name,
                             std::initializer_list<std::string_view> needed) {
  const Message* message = database.find(name);
  if (message == nullptr) {
    return Error{ErrorKind::invalid,
                 fmt::format("{} has no message '{}' for the CAN exciter", database.origin, name)};
  }
  if (message->size > protocol::can::kMaxClassicLength) {
    return Error{
        ErrorKind::invalid,
        fmt::format(
            "{}: message {} has {} bytes; the CAN exciter takes classic frames of at most 8",
            database.origin, name, message->size)};
  }
  for (const auto signal : needed) {
    const auto* found = message->find(signal);
    if (found == nullptr) {
      return Error{ErrorKind::invalid,
                   fmt::format("{}: message {} has no signal '{}', which the CAN exciter "
                               "needs",
                               database.origin, name, signal)};
    }
    if (found->multiplexed) {
      return Error{
          ErrorKind::invalid,
          fmt::format(
              "{}: signal {} of message {} is multiplexed; the CAN exciter needs it in every "
              "frame",
              database.origin, signal, name)};
    }
  }
  return *message;
}

// Empty also for a value outside the signal's range, which must not be used.
std::optional<double> value_of(const Message& message, std::string_view name, const Frame& frame) {
  const auto* signal = message.find(name);
  if (signal == nullptr) return std::nullopt;
  const auto decoded = protocol::can::decode(message, *signal, frame.bytes());
  if (decoded.presence != protocol::can::Presence::present || !std::isfinite(decoded.value) ||
      !protocol::can::in_range(*signal, decoded.value)) {
    return std::nullopt;
  }
  return decoded.value;
}

// A DBC file gives the unit of the scaled value. Converts the signal to SI.
Result<void> convert(const std::string& origin, Message& message, std::string_view name,
                     Dimension dimension) {
  const auto signal = std::ranges::find(message.signals, name, &protocol::can::Signal::name);
  if (signal == message.signals.end() || signal->unit.empty()) return {};
  const auto unit = unit_called(signal->unit, dimension);
  if (!unit) {
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: signal {} of message {} is in \"{}\", which is no unit of it; known "
                    "are {}. For another one, change its factor, offset and unit",
                    origin, name, message.name, signal->unit, units_of(dimension))};
  }
  if (signal->minimum != 0.0 || signal->maximum != 0.0) {
    signal->minimum = unit->to_si(signal->minimum);
    signal->maximum = unit->to_si(signal->maximum);
  }
  signal->factor *= unit->scale;
  signal->offset = unit->to_si(signal->offset);
  signal->unit = si_unit(dimension);
  return {};
}

Result<void> check_mask(const Database& database, const Message& message, const char* key,
                        std::uint32_t mask) {
  const int bits = message.find("status")->length;
  if (bits >= 32 || mask >> bits == 0) return {};
  return Error{ErrorKind::invalid,
               fmt::format("{} {} has bits beyond the {} bits of the signal status of message {} "
                           "in {}",
                           key, mask, bits, message.name, database.origin)};
}

std::optional<std::uint32_t> bits_of(const Message& message, std::string_view name,
                                     const Frame& frame) {
  const auto raw = protocol::can::raw_bits(*message.find(name), frame.bytes());
  if (!raw) return std::nullopt;
  return static_cast<std::uint32_t>(*raw);
}

}  // namespace

Result<ExciterCodec> ExciterCodec::make(const Database& database,
                                        const config::CanExciter& config) {
  auto setpoint =
      find_message(database, config.setpoint_message, {"frequency", "amplitude", "enable"});
  if (!setpoint) return setpoint.error();
  auto status = find_message(database, config.status_message, {"status", "fault"});
  if (!status) return status.error();
  for (const auto& [name, dimension] :
       {std::pair{"frequency", Dimension::frequency},
        std::pair{"amplitude", Dimension::acceleration}, std::pair{"ramp", Dimension::time},
        std::pair{"heartbeat_timeout", Dimension::time}}) {
    for (Message* message : {&*setpoint, &*status}) {
      if (auto good = convert(database.origin, *message, name, dimension); !good)
        return good.error();
    }
  }
  for (const auto& [key, mask] : {std::pair{"status_running", config.status_running},
                                  std::pair{"status_ready", config.status_ready}}) {
    if (auto good = check_mask(database, *status, key, mask); !good) return good.error();
  }
  ExciterCodec codec;
  codec.setpoint_ = std::move(*setpoint);
  codec.status_ = std::move(*status);
  codec.running_mask_ = config.status_running;
  codec.ready_mask_ = config.status_ready;
  return codec;
}

Result<Frame> ExciterCodec::setpoint(const Setpoint& setpoint, std::uint64_t heartbeat) const {
  Frame frame;
  frame.id = setpoint_.id;
  frame.extended = setpoint_.extended;
  frame.length = static_cast<std::uint8_t>(setpoint_.size);
  const std::span<std::uint8_t> data{frame.data.data(), frame.length};
  const auto put = [&](std::string_view name, double value) -> Result<void> {
    const auto* signal = setpoint_.find(name);
    if (signal == nullptr) return {};
    if (!protocol::can::in_range(*signal, value)) {
      return Error{ErrorKind::invalid,
                   fmt::format("CAN exciter: {} {} is outside {} to {} {}", name, value,
                               signal->minimum, signal->maximum, signal->unit)};
    }
    return encode(*signal, value, data);
  };
  std::uint64_t counter = heartbeat;
  if (const auto* signal = setpoint_.find("heartbeat"); signal != nullptr && signal->length < 32) {
    counter %= std::uint64_t{1} << signal->length;
  }
  if (auto done = put("frequency", setpoint.frequency_hz); !done) return done.error();
  if (auto done = put("amplitude", setpoint.amplitude); !done) return done.error();
  if (auto done = put("enable", setpoint.enable ? 1.0 : 0.0); !done) return done.error();
  if (auto done = put("ramp", setpoint.ramp_s); !done) return done.error();
  if (auto done = put("heartbeat", static_cast<double>(counter)); !done) return done.error();
  return frame;
}

bool ExciterCodec::is_status(const Frame& frame) const {
  return !frame.error && !frame.remote && !frame.fd && frame.id == status_.id &&
         frame.extended == status_.extended;
}

bool ExciterCodec::is_setpoint(const Frame& frame) const {
  return !frame.error && frame.id == setpoint_.id && frame.extended == setpoint_.extended;
}

bool ExciterCodec::commands_motion(const Frame& frame) const {
  const auto enable = bits_of(setpoint_, "enable", frame);
  const auto amplitude = bits_of(setpoint_, "amplitude", frame);
  return frame.length != setpoint_.size || !enable || !amplitude ||
         (*enable != 0 && *amplitude != 0);
}

Result<ExciterStatus> ExciterCodec::status(const Frame& frame, Nanoseconds t) const {
  const auto bits = bits_of(status_, "status", frame);
  const auto fault = bits_of(status_, "fault", frame);
  if (frame.length != status_.size || !bits || !fault) {
    return Error{ErrorKind::invalid,
                 fmt::format("CAN exciter: status message {} came with {} bytes, expected {}; "
                             "check the DBC file, and that no other node sends with this "
                             "identifier",
                             status_.name, frame.length, status_.size)};
  }
  ExciterStatus status;
  status.t = t;
  status.running = (*bits & running_mask_) != 0;
  status.ready = (*bits & ready_mask_) == ready_mask_ && *fault == 0;
  status.fault = *fault;
  status.frequency_hz = value_of(status_, "frequency", frame);
  status.amplitude = value_of(status_, "amplitude", frame);
  status.heartbeat_timeout_s = value_of(status_, "heartbeat_timeout", frame);
  return status;
}

Nanoseconds ExciterCodec::status_limit() const {
  if (!status_.cycle_time_s) return std::chrono::milliseconds(500);
  return std::max<Nanoseconds>(std::chrono::milliseconds(100),
                               from_seconds(5 * *status_.cycle_time_s));
}

}  // namespace shaker::drivers::can
