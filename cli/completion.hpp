// The completion of the command line for bash, zsh and fish, from the options that CLI11 knows: what
// main() defines is the one source of all three.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <CLI/CLI.hpp>

namespace CLI::detail {

// How the help calls a path. The completion offers files for it.
template <>
constexpr const char* type_name<std::filesystem::path>() {
  return "FILE";
}

}  // namespace CLI::detail

namespace shaker::cli {

// The type name of an option or a positional that is a folder.
inline constexpr const char* kFolderType = "DIR";

// Adds the command "completion SHELL" to `app`. It sets `action` to what prints the script. Both
// must outlive the parsing and the action.
void add_completion(CLI::App& app, std::function<int()>& action);

// The script for "bash", "zsh" or "fish". Throws std::invalid_argument for another shell.
std::string completion_for(const std::string& shell, const CLI::App& app);

}  // namespace shaker::cli
