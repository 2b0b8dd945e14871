// The error sentence for an unknown command: its name, and the known ones, the most similar
// first.
#pragma once

#include <string>
#include <vector>

namespace shaker::cli {

std::string unknown_command(const std::string& given, std::vector<std::string> known);

}  // namespace shaker::cli
