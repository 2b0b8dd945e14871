// The CAN interface of the virtual rig. sim/oleosim.dbc describes the frames. This file packs
// them with code of its own, so that the daemon's codec is tested against an independent
// implementation.
//
//   STROKE, TABLE   every sample: displacement and table acceleration, with a counter
//   AUX_A .. AUX_D  every 10th sample, if requested: the auxiliary quantities, two in a frame
//   STATUS          every 20 ms: the controller's status and fault
//   SETPOINT        received: frequency, amplitude, enable, ramp, heartbeat
//
// The packing functions are pure; CanFace owns the socket. When the interface disappears,
// CanFace opens a new socket after one second at the earliest. The frames sent meanwhile are
// lost, as on a real bus.
#pragma once

#include <cstdint>
#include <string>

#include <linux/can.h>

#include "base/result.hpp"
#include "base/unique_fd.hpp"
#include "sim/virtual_rig.hpp"

namespace shaker::sim {

inline constexpr std::uint32_t kSetpointId = 256, kStatusId = 257, kStrokeId = 385, kTableId = 386,
                               kAuxiliaryId = 387;  // the first of four

can_frame stroke_frame(const RigSample& sample);
can_frame table_frame(const RigSample& sample);
can_frame auxiliary_frame(const RigSample& sample, std::size_t pair);  // pair: 0 to 3
can_frame status_frame(const RigStatus& status);

// Applies a SETPOINT frame to the controller; STATUS shows whether the rig refused it. Ignores
// all other frames.
void obey(const can_frame& frame, VirtualRig& rig);

class CanFace {
 public:
  // Returns an Error when the kernel has no CAN support or the interface does not exist.
  static Result<CanFace> open(const std::string& interface);

  int descriptor() const { return socket_.get(); }
  void send(const can_frame& frame, Nanoseconds now);
  // Reads all setpoint frames that have arrived and applies them. Does not block.
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
