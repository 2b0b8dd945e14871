// Reads a DBC file from disk. An Error is parse_dbc's, or names the file that cannot be read.
#pragma once

#include <filesystem>

#include "base/result.hpp"
#include "protocol/can/database.hpp"

namespace shaker::drivers::can {

Result<protocol::can::Database> load_dbc(const std::filesystem::path& file);

}  // namespace shaker::drivers::can
