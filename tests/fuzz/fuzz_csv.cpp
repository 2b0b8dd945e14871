// Any text as a CSV file: the result is columns of equal length with finite numbers, or a
// sentence with a place.
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "cli/csv.hpp"
#include "tests/fuzz/target.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  const auto table =
      shaker::cli::read_csv(in, "fuzz.csv", {{"t", "excitation", "displacement"}, {"t", "y"}});
  if (!table) {
    if (!table.error().what.starts_with("fuzz.csv:")) std::abort();
    return 0;
  }
  const std::size_t rows = table->columns.at("t").size();
  for (const auto& [name, column] : table->columns) {
    if (column.size() != rows) std::abort();
    for (const double value : column)
      if (!std::isfinite(value)) std::abort();
  }
  return 0;
}
