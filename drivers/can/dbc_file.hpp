// Reads a DBC file from disk; the sentences are parse_dbc's.
#pragma once

#include <filesystem>

#include "base/result.hpp"
#include "protocol/can/database.hpp"

namespace shaker::drivers::can {

Result<protocol::can::Database> load_dbc(const std::filesystem::path& file);

}  // namespace shaker::drivers::can
