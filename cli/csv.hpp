// Reads the columns that are wanted from a comma-separated file with a header row.
//
// Columns are found by name and may stand in any order among others. Windows line ends and a UTF-8
// byte order mark are accepted; a quoted field is not. Bounded: at most kMaxCsvRows rows and
// kMaxCsvLine bytes a line. An Error names file, line and column (counted from 1).
#pragma once

#include <filesystem>
#include <istream>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::cli {

inline constexpr std::size_t kMaxCsvRows = 2'000'000;
inline constexpr std::size_t kMaxCsvLine = 64 * 1024;

struct CsvTable {
  std::map<std::string, std::vector<double>> columns;  // of equal length, all finite
};

// `alternatives`: lists of column names; the first list whose columns are all there is read. An
// Error when none is complete, naming what there is and what is wanted. `most`: no number may be
// larger in size.
Result<CsvTable> read_csv(std::istream& in, const std::string& origin,
                          const std::vector<std::vector<std::string>>& alternatives,
                          double most = std::numeric_limits<double>::infinity());
Result<CsvTable> read_csv(const std::filesystem::path& file,
                          const std::vector<std::vector<std::string>>& alternatives,
                          double most = std::numeric_limits<double>::infinity());

}  // namespace shaker::cli
