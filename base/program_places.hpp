// Paths of the project's other programs: beside this one in a build folder, or installed.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace shaker {

// The paths in the order to try: the folder of this program, then ../libexec/shakerd. Never
// empty; does not check whether the files exist.
std::vector<std::filesystem::path> program_places(std::string_view name);

}  // namespace shaker
