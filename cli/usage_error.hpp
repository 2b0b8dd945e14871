// What is wrong with a command line, as one sentence with its place and the remedy.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace shaker::cli {

// For an unknown command: its name, and the known ones, the most similar first.
std::string unknown_command(const std::string& given, std::vector<std::string> known);

// For what `app` found wrong when it parsed a command line.
std::string usage_error(const CLI::ParseError& error, const CLI::App& app);

}  // namespace shaker::cli
