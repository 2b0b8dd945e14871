// Any text as a log of Modbus polls: the result is no line, or a line whose blocks are
// unchanged after writing and reading.
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>

#include "protocol/modbus/register_log.hpp"
#include "tests/fuzz/target.hpp"

namespace modbus = shaker::protocol::modbus;

namespace {

constexpr modbus::Block kWanted[] = {{modbus::RegisterTable::input, 6, 6},
                                     {modbus::RegisterTable::input, 0, 1},
                                     {modbus::RegisterTable::holding, 10, 1},
                                     {modbus::RegisterTable::holding, 65535, 2}};

void look_at(std::string_view line) {
  const auto found = modbus::parse_register_line(line);
  if (!found) return;
  if (found->asked_ns < 0 || found->received_ns < found->asked_ns) std::abort();
  std::string_view blocks = found->blocks;
  if (!blocks.empty() &&
      (blocks.data() < line.data() || blocks.data() + blocks.size() > line.data() + line.size())) {
    std::abort();
  }
  for (int step = 0; step < 8 && !blocks.empty(); ++step) {
    const std::size_t before = blocks.size();
    for (const modbus::Block& wanted : kWanted) {
      std::array<std::uint16_t, 6> words{}, again{};
      const auto room = static_cast<std::size_t>(wanted.words);
      if (!modbus::take_block(blocks, wanted, std::span(words).first(room))) continue;
      std::string text;
      modbus::begin_register_line(text, found->asked_ns, found->received_ns);
      modbus::add_block(text, wanted, std::span(words).first(room));
      const auto reread = modbus::parse_register_line(text);
      if (!reread || reread->asked_ns != found->asked_ns) std::abort();
      std::string_view rest = reread->blocks;
      if (!modbus::take_block(rest, wanted, std::span(again).first(room))) std::abort();
      if (!rest.empty() || again != words) std::abort();
    }
    if (blocks.size() == before) break;
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text(reinterpret_cast<const char*>(data), size);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    look_at(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return 0;
}
