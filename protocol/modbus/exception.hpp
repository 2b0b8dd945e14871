// What a Modbus device means when it answers "no", and what to do about it.
//
// Source: Modbus Application Protocol V1.1b3, chapter 7; codes 07 and 09 are older devices'.
#pragma once

#include <string>

namespace shaker::protocol::modbus {

enum class Reaction {
  give_up,  // asking again gives the same answer
  retry,    // busy: ask again a little later
  accepted  // not an error: it is working on it, the result is seen by reading back
};

Reaction reaction_to(int exception_code);

// One sentence: code, meaning, remedy. Any code, also ones that no standard knows.
std::string exception_sentence(int exception_code);

}  // namespace shaker::protocol::modbus
