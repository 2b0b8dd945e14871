#include "cli/usage_error.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/documents_in.hpp"

namespace shaker::cli {
namespace {

constexpr std::size_t kOptionsShown = 8;

// Levenshtein distance: the number of letters to change, add or remove.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t k = 0; k < b.size(); ++k) {
      const std::size_t change = diagonal + (a[i] == b[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({change, row[k] + 1, diagonal + 1});
    }
  }
  return row.back();
}

void nearest_first(const std::string& name, std::vector<std::string>& known) {
  std::ranges::stable_sort(known, {}, [&](const std::string& k) { return distance(name, k); });
}

// What stands between `before` and `after` in the text, `after` at its end if it is empty.
std::optional<std::string> between(const std::string& text, const std::string& before,
                                   const std::string& after) {
  const auto from = text.find(before);
  if (from == std::string::npos) return std::nullopt;
  const auto begin = from + before.size();
  const auto end = after.empty() ? text.size() : text.find(after, begin);
  if (end == std::string::npos) return std::nullopt;
  return text.substr(begin, end - begin);
}

// An option that there is not, or a word too many.
std::string unexpected(const CLI::App& command) {
  std::vector<std::string> words = command.remaining();
  std::stable_partition(words.begin(), words.end(),
                        [](const std::string& w) { return w.starts_with("-"); });
  const std::string word = words.empty() ? "" : words.front().substr(0, 60);
  if (!word.starts_with("-")) return fmt::format("\"{}\" is one word too many", printable(word));
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    if (option->nonpositional()) known.push_back("--" + option->get_lnames().front());
  nearest_first(word, known);
  known.resize(std::min(known.size(), kOptionsShown));
  return fmt::format("there is no {}; there are {}", printable(word), fmt::join(known, ", "));
}

// The words of CLI11 for a value, without its digits of the largest number.
std::string of_value(const std::string& said) {
  constexpr const char* kLargest = " to 17976931348623157";
  if (said.find(kLargest) != std::string::npos) {
    const std::string option = said.substr(0, said.find(':'));
    if (const auto value = between(said, "Value ", " not in range"))
      return fmt::format("{}: {} is not a positive number", option, *value);
  }
  if (const auto option = between(said, "Could not convert: ", " = "))
    return fmt::format("{}: \"{}\" is not a number", *option,
                       between(said, " = ", "").value_or(""));
  if (const auto missing = between(said, "", " is required"))
    return *missing == "A subcommand" ? "give a command" : *missing + " is missing";
  if (const auto one = between(said, "", " excludes "))
    return fmt::format("give {} or {}, not both", *one,
                       between(said, " excludes ", "").value_or(""));
  return said;
}

}  // namespace

std::string unknown_command(const std::string& given, std::vector<std::string> known) {
  const std::string name = given.substr(0, 60);
  nearest_first(name, known);
  return fmt::format("there is no command \"{}\"; there are {}", printable(name),
                     fmt::join(known, ", "));
}

std::string usage_error(const CLI::ParseError& error, const CLI::App& app) {
  const auto commands = app.get_subcommands();
  const CLI::App& command = commands.empty() ? app : *commands.front();
  const std::string place = commands.empty() ? "" : command.get_name() + ": ";
  const std::string whole = commands.empty() ? "" : " " + command.get_name();
  const bool more = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  return fmt::format("{}{}; `{}{} --help` explains", place,
                     more ? unexpected(command) : of_value(error.what()), app.get_name(), whole);
}

}  // namespace shaker::cli
