#include "drivers/can/dbc_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

namespace shaker::drivers::can {

Result<protocol::can::Database> load_dbc(const std::filesystem::path& file) {
  std::error_code unreadable;
  if (std::filesystem::is_directory(file, unreadable)) {
    return Error{ErrorKind::invalid,
                 fmt::format("{} is a folder, expected a DBC file", file.string())};
  }
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    return Error{
        ErrorKind::invalid,
        fmt::format("cannot read the DBC file {}: {}; give a path relative to the rig file",
                    file.string(), std::strerror(errno))};
  }
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return protocol::can::parse_dbc(text, file.string());
}

}  // namespace shaker::drivers::can
