// Any text as a log: each line gives a frame that a bus can carry, or nothing.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include "protocol/can/candump_log.hpp"
#include "protocol/can/error_frame.hpp"
#include "tests/fuzz/target.hpp"

namespace can = shaker::protocol::can;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text{reinterpret_cast<const char*>(data), size};
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    const auto entry = can::parse_log_line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!entry) continue;
    const can::Frame& frame = entry->frame;
    if (entry->t_ns < 0 || entry->interface.empty()) std::abort();
    if (frame.length > (frame.fd ? can::kMaxLength : can::kMaxClassicLength)) std::abort();
    if (frame.id > (frame.extended || frame.error ? can::kExtendedMask : can::kStandardMask)) {
      std::abort();
    }
    if (!frame.error) continue;
    can::interpret_error(frame);
    std::string sentence;
    can::describe_error(frame, "can0", sentence);
    if (sentence.empty()) std::abort();
  }
  return 0;
}
