// Reads registers of a Modbus device from a rig file, converts their units and detects
// overlaps.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "config/object_reader.hpp"
#include "protocol/modbus/register.hpp"

namespace shaker::config {

using protocol::modbus::RegisterSpec;

RegisterSpec read_register(const Node& node, const std::string& pointer, Findings& findings);
// A counter that wraps: only its difference between samples matters.
RegisterSpec read_timestamp(const Node& node, const std::string& pointer, Findings& findings);

// Converts scale and offset: raw * scale + offset is in `unit` before (without one in `wanted`),
// and in `wanted` afterwards, which `unit` then names. Returns false if there is no conversion.
bool to_unit(double& scale, double& offset, std::string& unit, std::string_view wanted);
bool to_unit(RegisterSpec& spec, std::string_view wanted);
// Adds the finding for a "unit" that has no conversion into `wanted`.
void complain_of_unit(ObjectReader& reader, std::string_view unit, std::string_view wanted);
// Both for a register. An empty `wanted` accepts any unit.
void convert(RegisterSpec& spec, std::string_view wanted, ObjectReader&& reader);

int words(const RegisterSpec& spec);  // number of 16-bit registers
// Adds findings for overlapping registers, which are always mistakes in a map. The names are
// keys of `reader`'s object.
void complain_of_overlaps(ObjectReader& reader,
                          const std::map<std::string, RegisterSpec>& registers);

}  // namespace shaker::config
