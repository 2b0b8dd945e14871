// Reads selected columns from a comma-separated file with a header row.
//
// Columns are found by name and may be in any order, among other columns. Windows line ends and
// a UTF-8 byte order mark are accepted; quoted fields are not. The size is limited: at most
// kMaxCsvRows rows and kMaxCsvLine bytes in a line. An Error names file, line and column
// (counted from 1). A header may state the unit behind the name: "t [ms]" or "t (ms)".
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
  std::map<std::string, std::string> units;            // of the columns whose header states one
};

// `alternatives`: lists of column names. The first list of which all columns exist is read;
// when none is complete, the Error names the columns that exist and those that are wanted.
// `origin`: the file's name for messages. `most`: the largest allowed modulus of a number.
Result<CsvTable> read_csv(std::istream& in, const std::string& origin,
                          const std::vector<std::vector<std::string>>& alternatives,
                          double most = std::numeric_limits<double>::infinity());
Result<CsvTable> read_csv(const std::filesystem::path& file,
                          const std::vector<std::vector<std::string>>& alternatives,
                          double most = std::numeric_limits<double>::infinity());

}  // namespace shaker::cli
