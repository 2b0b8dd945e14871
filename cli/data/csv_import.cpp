// CSV files as an import's source: those of `shakerctl export`, or of any other program.
#include <algorithm>
#include <fstream>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/csv.hpp"
#include "cli/data/import_data.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

Error refuse_file(const fs::path& file, const std::string& why) {
  return {ErrorKind::invalid, fmt::format("{}: {}", file.string(), why)};
}

std::string column_name(const ByChannel& columns, const std::string& channel) {
  const auto given = columns.find(channel);
  return given == columns.end() ? channel : given->second;
}

// The lists of columns to look for, the richest first. A channel that the command line maps is
// wanted in every file.
std::vector<std::vector<std::string>> wanted_columns(const ByChannel& columns, bool excitation) {
  std::vector<std::vector<std::string>> lists;
  for (int extra = 7; extra >= 0; --extra) {
    std::vector<std::string> list = {column_name(columns, "t"),
                                     column_name(columns, "displacement")};
    bool complete = true;
    int bit = 4;
    for (const char* channel : {"excitation", "acceleration", "force"}) {
      if ((extra & bit) != 0)
        list.push_back(column_name(columns, channel));
      else
        complete = complete && !columns.contains(channel);
      bit /= 2;
    }
    if (complete && (excitation || (extra & 4) == 0)) lists.push_back(std::move(list));
  }
  if (columns.empty()) lists.push_back({"t", "y"});
  return lists;
}

ImportRun run_of_table(const CsvTable& table, const ByChannel& columns) {
  ImportRun run;
  const auto take = [&](const char* channel, const std::string& name) {
    const auto found = table.columns.find(name);
    if (found == table.columns.end()) return;
    const auto unit = table.units.find(name);
    run.columns[channel] = {found->second, unit == table.units.end() ? "" : unit->second};
  };
  take("displacement", "y");
  for (const char* channel : kImportChannels)
    take(channel, column_name(columns, channel));
  return run;
}

// What `shakerctl export` writes beside its CSV files; null where another program wrote them.
Result<Json> export_facts(const fs::path& folder, const std::vector<fs::path>& files) {
  for (const fs::path& file : files) {
    if (!file.filename().string().ends_with("_export.json")) continue;
    std::ifstream in(file);
    Json facts = Json::parse(in, nullptr, false);
    if (facts.is_object() && facts.contains("runs") && facts["runs"].is_array()) return facts;
    return refuse_file(file, "is not what `shakerctl export` writes; mend it, or take it out of " +
                                 folder.string());
  }
  return Json();
}

std::string text_in(const Json& object, const char* key) {
  return object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : "";
}

// A run of `shakerctl export`: without the cycles that were not accepted, and without an
// excitation that was not measured.
Result<ImportRun> exported_run(const fs::path& file, const Json& described) {
  std::ifstream in(file);
  std::string header, first;
  std::getline(in, header);
  std::getline(in, first);
  std::vector<std::string> wanted = {"t", "displacement", "accepted", "frequency_hz", "amplitude"};
  if (first.find(",,") == first.npos) wanted.emplace_back("excitation");
  auto table = read_csv(file, {wanted});
  if (!table) return table.error();
  const std::vector<double> accepted = table->columns["accepted"];
  for (auto& [name, values] : table->columns) {
    std::size_t row = 0;
    std::erase_if(values, [&](double) { return accepted[row++] == 0.0; });
  }
  ImportRun run = run_of_table(*table, {});
  run.name = text_in(described, "name");
  const std::vector<double>& f = table->columns["frequency_hz"];
  if (f.empty()) return refuse_file(file, "has no accepted cycle");
  const auto rows = static_cast<double>(f.size());
  run.frequency_hz = std::accumulate(f.begin(), f.end(), 0.0) / rows;
  if (!run.columns.contains("excitation"))
    run.amplitude = std::accumulate(table->columns["amplitude"].begin(),
                                    table->columns["amplitude"].end(), 0.0) /
                    rows;
  run.columns["t"].unit = "s";
  run.columns["displacement"].unit = "m";
  if (run.columns.contains("excitation")) run.columns["excitation"].unit = "m/s^2";
  return run;
}

Result<ImportData> exported_campaign(const fs::path& folder, const Json& facts) {
  ImportData data;
  data.name = text_in(facts, "campaign");
  for (const char* key : {"rig", "started_utc", "finished_utc", "status"})
    data.facts.emplace_back(key, text_in(facts, key));
  if (facts.contains("model")) data.model_json = facts["model"].dump();
  for (const Json& described : facts["runs"]) {
    const fs::path file = folder / fs::path(text_in(described, "file")).filename();
    auto run = exported_run(file, described);
    if (!run) return run.error();
    data.runs.push_back(std::move(*run));
  }
  return data;
}

}  // namespace

Result<ImportData> read_csv_folder(const fs::path& path, const ByChannel& columns) {
  std::error_code none;
  std::vector<fs::path> files = {path};
  const bool folder = fs::is_directory(path, none);
  if (folder) {
    files.clear();
    for (const auto& entry : fs::directory_iterator(path, none))
      files.push_back(entry.path());
    std::ranges::sort(files);
    if (fs::exists(path / "campaign.json", none))
      return refuse_file(path, "is a campaign's folder already; `shakerctl diagnose` reads it");
    const auto facts = export_facts(path, files);
    if (!facts) return facts.error();
    if (!facts->is_null()) return exported_campaign(path, *facts);
    std::erase_if(files, [](const fs::path& file) { return file.extension() != ".csv"; });
    if (files.empty()) return refuse_file(path, "holds no CSV file (.csv)");
  }
  ImportData data;
  data.name = (folder ? path / "" : path).parent_path().filename().string();
  if (!folder) data.name = path.stem().string();
  for (const fs::path& file : files) {
    const auto table = read_csv(file, wanted_columns(columns, true));
    if (!table) return table.error();
    data.runs.push_back(run_of_table(*table, columns));
    data.runs.back().name = file.stem().string();
  }
  return data;
}

}  // namespace shaker::cli
