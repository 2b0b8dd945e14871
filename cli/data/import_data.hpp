// What `shakerctl import` reads from the files of other programs. A reader only finds runs and
// channels; units are converted, and the campaign's folder is written, in one place for all.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"

namespace shaker::cli {

// The channels of a run that an import knows.
inline constexpr const char* kImportChannels[] = {"t", "displacement", "excitation", "acceleration",
                                                  "force"};

struct ImportColumn {
  std::vector<double> values;
  std::string unit;  // as the file states it; empty: it states none
};

struct ImportRun {
  std::string name;
  std::optional<double> frequency_hz, amplitude;  // amplitude: m/s^2, of the excitation
  std::map<std::string, ImportColumn> columns;    // by channel
};

struct ImportData {
  std::string name;
  std::string model_json;                                  // empty: the file holds no model
  std::vector<std::pair<std::string, std::string>> facts;  // rig, dates; for import.json
  std::vector<std::string> left_out;                       // channels that no run can hold
  std::vector<ImportRun> runs;
};

// By channel: the unit, or the name of its column in the files.
using ByChannel = std::map<std::string, std::string>;

struct ImportWanted {
  ByChannel units, columns;
  std::vector<double> frequencies_hz, amplitudes;  // one for all runs, or one for each
  std::string kind;                                // of all runs; empty: by their channels
  double reference_mass = 0.0;                     // kg; 0: none
};

// CSV files with a header row: a folder with one for each run, or one file.
Result<ImportData> read_csv_folder(const std::filesystem::path& path, const ByChannel& columns);
// A MAT file: a struct for each run (docs/cli_data.md), or the variables of one run.
Result<ImportData> read_mat(const std::filesystem::path& file, const ByChannel& columns);
// Time responses of a Universal File (data sets 58, ASCII).
Result<ImportData> read_uff(const std::filesystem::path& file, const ByChannel& columns);

// Completes the runs by what the command line gives, checks them, and converts all columns to s,
// m, m/s^2 and N. An Error names run, channel and remedy.
Result<void> complete(ImportData& data, const ImportWanted& wanted);

// Writes campaign.json with a CSV file for each run, import.json with what else is known, and
// model.json if there is a model. The folder must not exist, or be empty.
Result<void> write_campaign_folder(const std::filesystem::path& folder, const ImportData& data,
                                   const ImportWanted& wanted);

}  // namespace shaker::cli
