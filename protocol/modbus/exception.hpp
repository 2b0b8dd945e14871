// The meaning of the exceptions of a Modbus device, and the reaction to them.
//
// Source: Modbus Application Protocol V1.1b3, chapter 7; codes 07 and 09 are from older
// devices.
#pragma once

#include <string>

namespace shaker::protocol::modbus {

enum class Reaction {
  give_up,  // a repetition gives the same answer
  retry,    // busy: repeat after a short pause
  accepted  // not an error: still working; a read-back shows the result
};

Reaction reaction_to(int exception_code);

// One sentence with code, meaning and remedy, for any code.
std::string exception_sentence(int exception_code);

}  // namespace shaker::protocol::modbus
