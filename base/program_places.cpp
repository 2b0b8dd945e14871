#include "base/program_places.hpp"

#include <system_error>

namespace shaker {

std::vector<std::filesystem::path> program_places(std::string_view name) {
  std::error_code trouble;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", trouble).parent_path();
  return {folder / name, folder.parent_path() / "libexec" / "shakerd" / name};
}

}  // namespace shaker
