// The exciter's controller: setpoints, ramp, enable, dead-man, faults. Knows the table, not the
// damper.
//
// Times are seconds since the rig began, on our clock.
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

  // When its patience ends; infinite when nothing is supervised.
  double deadline() const;

  RigStatus status(double now) const;
  const RigSettings& settings() const { return settings_; }
  const TableMotion& table() const { return table_; }

 private:
  void follow(double now);

  TableMotion table_;
  RigSettings settings_;
  FaultCode fault_ = FaultCode::none;
  bool acknowledged_ = true;  // disabled by the master since the fault
  double last_beat_ = 0.0;
};

}  // namespace shaker::sim
