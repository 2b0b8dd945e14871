// The part of CANopen that a CiA 406 transducer needs: NMT start, SYNC, and the messages of the
// node about itself (boot-up, heartbeat, emergency). Its measurements are ordinary signals of
// the DBC file.
//
// A boot-up message after measurements means that the sensor lost power. The samples just
// before it are then unreliable, and the node must be started again. Pure (frames in, frames
// out); one thread; does not allocate while the sentence has room. Source: CiA 301 4.2 (7.2.8
// NMT, 7.2.5 SYNC, 7.2.7 EMCY), CiA 406.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "base/clock.hpp"
#include "config/rig.hpp"
#include "drivers/can/frame_decoder.hpp"
#include "protocol/can/frame.hpp"

namespace shaker::drivers::can {

class CanopenNode {
 public:
  explicit CanopenNode(const config::CanOpen& config) : config_(config) {}

  std::array<Identifier, 2> identifiers() const;  // emergency, heartbeat

  // A new connection: the node is to be started if configured, and SYNC begins at `now`.
  void restart(Nanoseconds now);
  // A measurement of the node has arrived, so it is operational.
  void measured() { seen_at_work_ = true; }

  enum class Event { none, booted, lost_power, emergency, emergency_over, not_operational };
  // Appends a sentence for the operator for every event except none, booted and emergency_over.
  Event on_frame(const protocol::can::Frame& frame, std::string& sentence);

  bool emergency() const { return emergency_; }  // until the node clears it

  // Returns true if `frame` is to be sent now. Call until it returns false.
  bool next_to_send(Nanoseconds now, protocol::can::Frame& frame);
  // Time of the next SYNC; Nanoseconds::max() without SYNC.
  Nanoseconds next_deadline() const;

 private:
  Event on_heartbeat(const protocol::can::Frame& frame, std::string& sentence);
  Event on_emergency(const protocol::can::Frame& frame, std::string& sentence);

  config::CanOpen config_;
  bool start_wanted_ = false;
  bool seen_at_work_ = false;
  bool emergency_ = false;
  Nanoseconds next_sync_{};
};

}  // namespace shaker::drivers::can
