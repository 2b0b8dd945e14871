// Where the project's other programs are: beside this one in a build folder, or installed.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace shaker {

// In the order in which to try them: the folder of this program, then ../libexec/shakerd. Never
// empty. Whether a file is there is not looked at.
std::vector<std::filesystem::path> program_places(std::string_view name);

}  // namespace shaker
