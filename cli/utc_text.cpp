#include "cli/utc_text.hpp"

namespace shaker::cli {

std::string readable_utc(const std::string& utc) {
  constexpr std::size_t kWithSeconds = 19;
  if (utc.size() < kWithSeconds || utc[10] != 'T') return utc;
  return utc.substr(0, 10) + " " + utc.substr(11, kWithSeconds - 11) + " UTC";
}

}  // namespace shaker::cli
