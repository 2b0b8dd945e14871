// The formats of `shakerctl export`. Each writer leaves whole files or none, and returns what it wrote.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/data/export_data.hpp"

namespace shaker::cli {

struct Written {
  std::string run;  // empty: all of them
  std::filesystem::path file;
  std::size_t count = 0;  // cycles, or samples where these were asked for
};

// A file a run and, beside them, NAME_export.json with units, rig, dates and model.
Result<std::vector<Written>> write_csv(const ExportData& data, bool samples,
                                       const std::filesystem::path& folder);
// One MAT file of version 7.3 (HDF5): `campaign`, and a struct a run (docs/cli says its fields).
Result<std::vector<Written>> write_mat(const ExportData& data, const std::filesystem::path& folder);
// One Universal File of data sets 58, ASCII: each run's cycles as time responses (function type 1) and the
// first harmonic of stroke over excitation of all runs as frequency response (type 4).
Result<std::vector<Written>> write_uff(const ExportData& data, const std::filesystem::path& folder);

}  // namespace shaker::cli
