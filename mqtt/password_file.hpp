// The password for the broker, from a file.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"

namespace shaker::mqtt {

// The first line. Returns an Error if the file is not a regular one, cannot be read, can be read
// by everybody, or its first line is empty or longer than 1000 bytes.
Result<std::string> read_password(const std::filesystem::path& file);

}  // namespace shaker::mqtt
