// Registers of a Modbus device in a rig file: how one is read, its unit, and that no two overlap.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "config/object_reader.hpp"
#include "protocol/modbus/register.hpp"

namespace shaker::config {

using protocol::modbus::RegisterSpec;

RegisterSpec read_register(const Node& node, const std::string& pointer, Findings& findings);
// A counter that wraps: its difference from one sample to the next is all that counts.
RegisterSpec read_timestamp(const Node& node, const std::string& pointer, Findings& findings);

// raw * scale + offset is in the stated unit (none: in `wanted`), and afterwards in `wanted`. False where
// there is no way from one to the other.
bool to_unit(RegisterSpec& spec, std::string_view wanted);
// The same, with a finding at the register's "unit". `wanted` may be empty: any unit is good.
void convert(RegisterSpec& spec, std::string_view wanted, ObjectReader&& reader);

int words(const RegisterSpec& spec);  // registers of 16 bits that it takes
// Two values in one register is always a slip of the pen in a map. Names are the keys of `reader`'s object.
void complain_of_overlaps(ObjectReader& reader,
                          const std::map<std::string, RegisterSpec>& registers);

}  // namespace shaker::config
