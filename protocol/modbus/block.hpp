// Plans the requests that read or write a set of registers: as few as possible, and never half
// a value.
//
// Adjacent registers share a request of at most 125 words read or 123 written (Modbus
// Application Protocol V1.1b3, 6.3 and 6.12). Other registers are not accessed: many devices
// answer a block with a gap in it with exception 02. Pure.
#pragma once

#include <span>
#include <vector>

#include "base/result.hpp"
#include "protocol/modbus/register.hpp"

namespace shaker::protocol::modbus {

inline constexpr int kMaxReadWords = 125;
inline constexpr int kMaxWriteWords = 123;

struct Block {
  RegisterTable table = RegisterTable::holding;
  int address = 0;
  int words = 0;
  bool operator==(const Block&) const = default;
};

// Place of the value of specs[i]: `offset` words into blocks[block].
struct Placement {
  int block = 0;
  int offset = 0;
};

struct Plan {
  std::vector<Block> blocks;          // sorted by table and address
  std::vector<Placement> placements;  // one for each spec, in the specs' order
};

// Plans reads. Specs may overlap (one register read as two values).
Plan plan_reads(std::span<const RegisterSpec> specs, int max_words = kMaxReadWords);

// Plans writes. Returns an Error if two specs share a register, or one is an input register.
Result<Plan> plan_writes(std::span<const RegisterSpec> specs, int max_words = kMaxWriteWords);

}  // namespace shaker::protocol::modbus
