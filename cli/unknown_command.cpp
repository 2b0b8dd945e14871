#include "cli/unknown_command.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/documents_in.hpp"

namespace shaker::cli {
namespace {

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

}  // namespace

std::string unknown_command(const std::string& given, std::vector<std::string> known) {
  const std::string name = given.substr(0, 60);
  std::ranges::stable_sort(known, {}, [&](const std::string& k) { return distance(name, k); });
  return fmt::format("there is no command \"{}\"; there are {}", printable(name),
                     fmt::join(known, ", "));
}

}  // namespace shaker::cli
