#include "drivers/can/canopen.hpp"

#include <initializer_list>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace shaker::drivers::can {
namespace {

using protocol::can::Frame;

constexpr std::uint32_t kNmt = 0x000, kSync = 0x080, kEmergency = 0x080, kHeartbeat = 0x700;
constexpr std::uint8_t kStartRemoteNode = 0x01;
constexpr std::uint8_t kBootUp = 0, kStopped = 4, kOperational = 5, kPreOperational = 127;

// Class of an error by the high byte of its code, CiA 301 table 26.
std::string_view error_class(unsigned code) {
  switch (code >> 8 & 0xF0) {
    case 0x10:
      return "generic error";
    case 0x20:
      return "current";
    case 0x30:
      return "supply voltage";
    case 0x40:
      return "temperature";
    case 0x50:
      return "device hardware";
    case 0x60:
      return "device software";
    case 0x70:
      return "additional modules";
    case 0x80:
      return "monitoring or communication";
    case 0x90:
      return "external error";
    default:
      return "device specific";
  }
}

Frame make_frame(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
  Frame frame;
  frame.id = id;
  for (const auto byte : data)
    frame.data[frame.length++] = byte;
  return frame;
}

}  // namespace

std::array<Identifier, 2> CanopenNode::identifiers() const {
  const auto node = static_cast<std::uint32_t>(config_.node_id);
  return {Identifier{kEmergency + node, false}, Identifier{kHeartbeat + node, false}};
}

void CanopenNode::restart(Nanoseconds now) {
  start_wanted_ = config_.start_node;
  seen_at_work_ = false;
  emergency_ = false;
  next_sync_ = now;
}

CanopenNode::Event CanopenNode::on_frame(const Frame& frame, std::string& sentence) {
  if (frame.error || frame.remote || frame.extended) return Event::none;
  const auto [emergency, heartbeat] = identifiers();
  if (frame.id == heartbeat.id) return on_heartbeat(frame, sentence);
  if (frame.id == emergency.id) return on_emergency(frame, sentence);
  return Event::none;
}

CanopenNode::Event CanopenNode::on_heartbeat(const Frame& frame, std::string& sentence) {
  if (frame.length < 1) return Event::none;
  const std::uint8_t state = frame.data[0] & 0x7F;  // bit 7 toggles in old node guarding
  const auto out = std::back_inserter(sentence);
  if (state == kOperational) {
    seen_at_work_ = true;
    return Event::none;
  }
  start_wanted_ = config_.start_node;
  if (state == kBootUp) {
    const bool mid_run = std::exchange(seen_at_work_, false);
    emergency_ = false;
    if (!mid_run) return Event::booted;
    fmt::format_to(
        out,
        "CANopen node {} booted in mid-run: the sensor lost power; its last block is discarded "
        "and it is {}; check its supply",
        config_.node_id, config_.start_node ? "started again" : "left as it is");
    return Event::lost_power;
  }
  const std::string_view name = state == kStopped          ? "stopped"
                                : state == kPreOperational ? "pre-operational"
                                                           : "in an unknown state";
  fmt::format_to(out, "CANopen node {} is {} ({}) and sends no measurements; {}", config_.node_id,
                 name, state,
                 config_.start_node ? "it is started again" : "its master must start it");
  return Event::not_operational;
}

CanopenNode::Event CanopenNode::on_emergency(const Frame& frame, std::string& sentence) {
  if (frame.length < 3) return Event::none;
  const unsigned code = frame.data[0] | static_cast<unsigned>(frame.data[1]) << 8;
  if (code < 0x100) {
    emergency_ = false;
    return Event::emergency_over;
  }
  emergency_ = true;
  fmt::format_to(
      std::back_inserter(sentence),
      "CANopen node {} reports emergency 0x{:04x} ({}), error register 0x{:02x}; its samples are "
      "suspect until it takes it back: see the sensor's manual",
      config_.node_id, code, error_class(code), frame.data[2]);
  return Event::emergency;
}

bool CanopenNode::next_to_send(Nanoseconds now, Frame& frame) {
  if (start_wanted_) {
    start_wanted_ = false;
    frame = make_frame(kNmt, {kStartRemoteNode, static_cast<std::uint8_t>(config_.node_id)});
    return true;
  }
  if (now < next_deadline()) return false;
  // Absolute deadlines avoid a drift of SYNC. Deadlines that were missed in a pause are
  // skipped.
  const auto period = from_seconds(config_.sync_period_s);
  next_sync_ += period;
  if (next_sync_ <= now) next_sync_ = now + period;
  frame = make_frame(kSync, {});
  return true;
}

Nanoseconds CanopenNode::next_deadline() const {
  return config_.sync_period_s > 0.0 ? next_sync_ : Nanoseconds::max();
}

}  // namespace shaker::drivers::can
