#include <cstdio>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"

namespace shaker::cli {

int fail(const Common& common, ExitCode code, const std::string& sentence) {
  std::fflush(stdout);
  fmt::print(stderr, "shakerctl: {}\n", sentence);
  if (common.json) {
    const nlohmann::ordered_json body = {{"error", sentence},
                                         {"exit_code", static_cast<int>(code)}};
    fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  return code;
}

}  // namespace shaker::cli
