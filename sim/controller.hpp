// The controller of the virtual exciter: setpoints, ramp, enable, dead-man and faults. It knows
// the table but not the damper.
//
// All times are seconds since the start of the rig, on the caller's clock. A `set_` function
// returns false and changes nothing when the value is out of range or the controller refuses
// it.
#pragma once

#include <limits>

#include "sim/table_motion.hpp"
#include "sim/virtual_rig.hpp"

namespace shaker::sim {

class Controller {
 public:
  Controller(TableMotion table, double heartbeat_timeout_s);

  bool set_frequency(double hz, double now);
  bool set_amplitude(double m_s2, double now);
  bool set_ramp(double seconds);
  bool set_heartbeat_timeout(double seconds, double now);
  bool set_enable(bool on, double now);
  void heartbeat(std::uint32_t counter, double now);

  void trip(FaultCode code, double now);
  void clear_fault() { fault_ = FaultCode::none; }

  // The time at which the dead-man stops the table; infinite when nothing is supervised.
  double deadline() const;

  RigStatus status(double now) const;
  const RigSettings& settings() const { return settings_; }
  const TableMotion& table() const { return table_; }

 private:
  void follow(double now);

  TableMotion table_;
  RigSettings settings_;
  FaultCode fault_ = FaultCode::none;
  bool acknowledged_ = true;  // the client has disabled the table since the fault
  double last_beat_ = 0.0;
};

}  // namespace shaker::sim
