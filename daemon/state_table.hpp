// The rig's states as a table: what each one promises, and where it may lead.
//
// The engine asks this table before every change; a change that is not listed is a programming
// error and ends in FAULT with the exciter stopped. Printed in daemon/README.md, which a test
// compares.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "daemon/engine.hpp"

namespace shaker::daemon {

inline constexpr int kStateCount = 7;

struct StateRow {
  State state;
  std::string_view name;                      // as published: "IDLE"
  std::string_view promise;                   // what holds while the rig is in it
  bool setpoint_may_leave;                    // an order to move other than "down to zero"
  bool keeps_alive;                           // the exciter's heartbeat is served
  std::array<bool, kStateCount> may_lead_to;  // by State
};

std::span<const StateRow> state_table();
const StateRow& row(State state);
inline std::string_view name(State state) {
  return row(state).name;
}
inline bool allowed(State from, State to) {
  return row(from).may_lead_to[static_cast<std::size_t>(to)];
}

}  // namespace shaker::daemon
