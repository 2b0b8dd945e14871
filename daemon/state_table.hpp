// The states of the rig as a table: what each state guarantees and which states may follow.
//
// The engine checks this table before every transition. A transition that is not listed is a
// programming error and ends in FAULT with the exciter stopped. daemon/README.md contains the
// table; a test compares the two.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "daemon/engine.hpp"

namespace shaker::daemon {

inline constexpr int kStateCount = 8;

struct StateRow {
  State state;
  std::string_view name;                      // as published: "IDLE"
  std::string_view promise;                   // the guarantee of the state
  bool setpoint_may_leave;                    // a setpoint above zero may be ordered
  bool keeps_alive;                           // motion is commanded, and the heartbeat is sent
  std::array<bool, kStateCount> may_lead_to;  // indexed by State
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
