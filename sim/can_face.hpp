// The virtual rig on a CAN bus: sim/oleosim.dbc describes the frames; they are packed here, in
// lines of our own.
//
//   STROKE, TABLE   every sample: displacement and table acceleration, with a counter
//   AUX_A .. AUX_D  every 10th sample, when asked for: the auxiliary quantities, two in a frame
//   STATUS          every 20 ms: the controller's status and fault
//   SETPOINT        received: frequency, amplitude, enable, ramp, heartbeat
//
// The packing is pure; CanFace owns the socket. A link that is down or gone is tried again every
// second; frames meanwhile are lost, as on a real bus.
#pragma once

#include <cstdint>
#include <string>

#include <linux/can.h>

#include "base/result.hpp"
#include "base/unique_fd.hpp"
#include "sim/virtual_rig.hpp"

namespace shaker::sim {

inline constexpr std::uint32_t kSetpointId = 256, kStatusId = 257, kStrokeId = 385, kTableId = 386,
                               kAuxiliaryId = 387;  // and the three after it

can_frame stroke_frame(const RigSample& sample);
can_frame table_frame(const RigSample& sample);
can_frame auxiliary_frame(const RigSample& sample, std::size_t pair);  // 0..3
can_frame status_frame(const RigStatus& status);

// Gives the setpoint of a frame to the controller; a refusal shows in STATUS. Other frames are
// ignored.
void obey(const can_frame& frame, VirtualRig& rig);

class CanFace {
 public:
  // An Error when the kernel has no CAN or the interface is not there.
  static Result<CanFace> open(const std::string& interface);

  int descriptor() const { return socket_.get(); }
  void send(const can_frame& frame, Nanoseconds now);
  // Takes the setpoints that have arrived.
  void receive(VirtualRig& rig, Nanoseconds now);
  std::uint64_t lost() const { return lost_; }

 private:
  CanFace(std::string interface, UniqueFd socket)
      : interface_(std::move(interface)), socket_(std::move(socket)) {}
  void lose_link(Nanoseconds now);

  std::string interface_;
  UniqueFd socket_;
  Nanoseconds retry_at_{};
  std::uint64_t lost_ = 0;
};

}  // namespace shaker::sim
