// The answer to a command that there is none of: its name, and those there are, the nearest first.
#pragma once

#include <string>
#include <vector>

namespace shaker::cli {

std::string unknown_command(const std::string& given, std::vector<std::string> known);

}  // namespace shaker::cli
