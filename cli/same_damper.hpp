// Are several campaigns of one damper? Each is estimated alone, and their parameters are compared.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/estimation_input.hpp"

namespace shaker::cli {

// A sentence that names the parameter that differs most, where it differs by more than noise
// explains. Nothing for one campaign, or where one of them alone has no estimate.
std::optional<std::string> disagreement(const InputOptions& options);
std::optional<std::string> disagreement(const std::vector<std::filesystem::path>& campaigns,
                                        const std::filesystem::path& model);

}  // namespace shaker::cli
