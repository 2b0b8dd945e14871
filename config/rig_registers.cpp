#include "config/rig_registers.hpp"

#include <array>
#include <iterator>

#include <fmt/format.h>

#include "base/unit.hpp"

namespace shaker::config {
namespace {

// The names of an enum's values, in order.
const std::array<std::string, 2> kTables = {"holding", "input"};
const std::array<std::string, 5> kTypes = {"u16", "i16", "u32", "i32", "f32"};
const std::array<std::string, 4> kOrders = {"abcd", "cdab", "badc", "dcba"};

}  // namespace

RegisterSpec read_register(const Node& node, const std::string& pointer, Findings& findings) {
  RegisterSpec spec;
  ObjectReader reader(node, pointer, findings);
  if (const auto table = reader.choice("table", kTables, false)) {
    spec.table = static_cast<protocol::modbus::RegisterTable>(*table);
  }
  reader.required("address", spec.address, at_least(0).at_most(65535));
  if (const auto type = reader.choice("type", kTypes, true)) {
    spec.type = static_cast<protocol::modbus::RegisterType>(*type);
  }
  if (const auto order = reader.choice("order", kOrders, false)) {
    spec.order = static_cast<protocol::modbus::WordOrder>(*order);
  }
  reader.optional("scale", spec.scale);
  if (spec.scale == 0.0) reader.complain("scale", "0 would lose every value; leave it out for 1");
  reader.optional("offset", spec.offset);
  reader.optional("unit", spec.unit);
  reader.optional("cyclic", spec.cyclic);
  reader.finish();
  return spec;
}

// A counter that wraps: only its difference between samples matters.
RegisterSpec read_timestamp(const Node& node, const std::string& pointer, Findings& findings) {
  const RegisterSpec spec = read_register(node, pointer, findings);
  ObjectReader reader(node, pointer, findings);
  using protocol::modbus::RegisterType;
  if (spec.type != RegisterType::u16 && spec.type != RegisterType::u32) {
    reader.complain("type", "a time stamp is a counter that wraps; allowed are u16, u32");
  }
  if (spec.unit != "us" && spec.unit != "ms" && spec.unit != "s") {
    reader.complain(
        "unit", fmt::format("\"{}\" is no unit of a time stamp; allowed are us, ms, s", spec.unit));
  }
  if (spec.scale < 0.0) reader.complain("scale", "a clock does not run backwards; above 0");
  return spec;
}

bool to_unit(double& scale, double& offset, std::string& unit, std::string_view wanted) {
  if (unit.empty()) return true;
  const auto found = conversion(unit, wanted);
  if (!found) return false;
  scale *= found->scale;
  offset = offset * found->scale + found->offset;
  unit = wanted;
  return true;
}

bool to_unit(RegisterSpec& spec, std::string_view wanted) {
  return to_unit(spec.scale, spec.offset, spec.unit, wanted);
}

void complain_of_unit(ObjectReader& reader, std::string_view unit, std::string_view wanted) {
  reader.complain(
      "unit", fmt::format("\"{}\" cannot be converted into {}; known are {}. For another one, set "
                          "scale and offset so that raw * scale + offset is in {}",
                          unit, wanted, units_like(wanted), wanted));
}

void convert(RegisterSpec& spec, std::string_view wanted, ObjectReader&& reader) {
  if (!wanted.empty() && !to_unit(spec, wanted)) complain_of_unit(reader, spec.unit, wanted);
}

int words(const RegisterSpec& spec) {
  return spec.type == protocol::modbus::RegisterType::u16 ||
                 spec.type == protocol::modbus::RegisterType::i16
             ? 1
             : 2;
}

void complain_of_overlaps(ObjectReader& reader,
                          const std::map<std::string, RegisterSpec>& registers) {
  for (auto a = registers.begin(); a != registers.end(); ++a) {
    for (auto b = std::next(a); b != registers.end(); ++b) {
      const RegisterSpec& first = a->second;
      const RegisterSpec& second = b->second;
      if (first.table == second.table && first.address < second.address + words(second) &&
          second.address < first.address + words(first)) {
        reader.complain(b->first,
                        fmt::format("register {} overlaps \"{}\" at {}; give each its own address",
                                    second.address, a->first, first.address));
      }
    }
  }
}

}  // namespace shaker::config
