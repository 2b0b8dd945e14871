#include "protocol/modbus/exception.hpp"

#include <fmt/format.h>

namespace shaker::protocol::modbus {
namespace {

struct Row {
  int code;
  Reaction reaction;
  const char* meaning;
  const char* remedy;
};

constexpr Row kRows[] = {
    {0x01, Reaction::give_up, "the device does not know this function",
     "check that the register's table (holding or input) is the one in its manual"},
    {0x02, Reaction::give_up, "the device has no such register",
     "check the address (0-based, as on the wire) and that a 32-bit value is not cut in half"},
    {0x03, Reaction::give_up, "the device refuses this value",
     "check the type, the scale and the limits set in the device"},
    {0x04, Reaction::give_up, "the device failed while doing it",
     "look at the device's own fault display, clear the fault and try again"},
    {0x05, Reaction::accepted, "the device has accepted and is still working on it",
     "nothing to do: the value is read back when it is done"},
    {0x06, Reaction::retry, "the device is busy",
     "it is asked again by itself; if this stays, ask less often or raise the response timeout"},
    {0x07, Reaction::give_up, "the device refuses to do this now (negative acknowledge)",
     "check its operating mode: remote control must be allowed and no local operation active"},
    {0x08, Reaction::give_up, "the device found a parity error in its own memory",
     "switch it off and on; if it comes back, the device needs service"},
    {0x09, Reaction::give_up, "the device gave an exception that the standard leaves undefined",
     "look the code up in the device's manual"},
    {0x0A, Reaction::give_up, "the gateway has no path to the device",
     "check the gateway's port and routing settings, and the unit id"},
    {0x0B, Reaction::give_up, "the gateway got no answer from the device behind it",
     "check that the device is on, its wiring to the gateway, and the unit id"},
};

const Row* find(int code) {
  for (const Row& row : kRows) {
    if (row.code == code) return &row;
  }
  return nullptr;
}

}  // namespace

Reaction reaction_to(int exception_code) {
  const Row* row = find(exception_code);
  return row ? row->reaction : Reaction::give_up;
}

std::string exception_sentence(int exception_code) {
  if (const Row* row = find(exception_code)) {
    return fmt::format("Modbus exception {:02X}: {}; {}", exception_code, row->meaning,
                       row->remedy);
  }
  return fmt::format(
      "Modbus exception {:02X}: not a code of the standard; look it up in the "
      "device's manual",
      exception_code);
}

}  // namespace shaker::protocol::modbus
