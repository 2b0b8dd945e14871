#include "cli/made_by.hpp"

#include "base/clock.hpp"
#include "cli/utc_text.hpp"

namespace shaker::cli {

std::string made_by() {
  return readable_utc(format_utc(RealClock().utc())) + " by shakerctl " SHAKER_VERSION;
}

}  // namespace shaker::cli
