// Whether a unit that a file or a device states is the SI unit that is wanted.
#pragma once

#include <string_view>

namespace shaker::protocol {

// Nothing stated counts as the SI unit. m/s^2 may be spelt as device files (DBC) do.
constexpr bool is_unit(std::string_view stated, std::string_view si) {
  if (stated.empty() || stated == si) return true;
  return si == "m/s^2" && (stated == "m/s2" || stated == "m/s²" || stated == "m/s/s");
}

}  // namespace shaker::protocol
