// The formats of `shakerctl export`. A writer leaves no incomplete file, and returns the files
// that it wrote.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/data/export_data.hpp"

namespace shaker::cli {

struct Written {
  std::string run;  // empty: all runs
  std::filesystem::path file;
  std::size_t count = 0;  // number of cycles, or of samples if these were requested
};

// One file for each run, and NAME_export.json with units, rig, dates and model.
Result<std::vector<Written>> write_csv(const ExportData& data, bool samples,
                                       const std::filesystem::path& folder);
// One MAT file of version 7.3 (HDF5): `campaign`, and a struct for each run (docs/cli.md lists
// its fields).
Result<std::vector<Written>> write_mat(const ExportData& data, const std::filesystem::path& folder);
// One Universal File of data sets 58, ASCII. The cycles of each run are time responses
// (function type 1). The first harmonic of stroke over excitation of all runs is a frequency
// response (type 4).
Result<std::vector<Written>> write_uff(const ExportData& data, const std::filesystem::path& folder);

}  // namespace shaker::cli
