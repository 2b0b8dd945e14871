// The folder of an imported campaign, as `diagnose` and `estimate` read it.
#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/data/export_data.hpp"
#include "cli/data/import_data.hpp"
#include "cli/data/out_file.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string kind_of(const ImportRun& run, const ImportWanted& wanted) {
  if (!wanted.kind.empty()) return wanted.kind;
  if (run.columns.contains("excitation") || (run.frequency_hz && run.amplitude)) return "periodic";
  return run.columns.contains("force") ? "imposed_motion" : "transient";
}

std::string file_of(const ImportRun& run) {
  return plain_file_name(run.name) + ".csv";
}

Json campaign_json(const ImportData& data, const ImportWanted& wanted) {
  static constexpr std::pair<const char*, const char*> kUnits[] = {
      {"displacement", "m"}, {"excitation", "m/s^2"}, {"acceleration", "m/s^2"}, {"force", "N"}};
  Json units = {{"time", "s"}};
  for (const auto& known : kUnits) {
    const auto holds = [&](const ImportRun& run) { return run.columns.contains(known.first); };
    if (std::ranges::any_of(data.runs, holds)) units[known.first] = known.second;
  }
  Json runs = Json::array();
  for (const ImportRun& run : data.runs) {
    Json entry = {{"name", run.name}, {"file", file_of(run)}, {"kind", kind_of(run, wanted)}};
    if (run.frequency_hz) entry["frequency_hz"] = *run.frequency_hz;
    if (run.amplitude) entry["amplitude"] = *run.amplitude;
    runs.push_back(std::move(entry));
  }
  Json root = {{"format", "shaker-campaign/1"}, {"name", data.name}, {"units", std::move(units)}};
  if (wanted.reference_mass > 0.0) root["reference_mass"] = wanted.reference_mass;
  root["runs"] = std::move(runs);
  return root;
}

Result<void> write_run(const std::filesystem::path& file, const ImportRun& run) {
  std::vector<const std::vector<double>*> columns;
  OutFile out(file);
  for (const char* channel : kImportChannels) {
    const auto found = run.columns.find(channel);
    if (found == run.columns.end()) continue;
    out.write("{}{}", columns.empty() ? "" : ",", channel);
    columns.push_back(&found->second.values);
  }
  out.write("\n");
  for (std::size_t i = 0; i < columns.front()->size(); ++i) {
    for (const auto* column : columns)
      out.write("{}{}", column == columns.front() ? "" : ",", (*column)[i]);
    out.write("\n");
  }
  return out.finish();
}

Result<void> write_json(const std::filesystem::path& file, const Json& json) {
  OutFile out(file);
  out.write("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
  return out.finish();
}

Result<void> expect_new(const std::filesystem::path& folder) {
  std::error_code trouble;
  std::filesystem::create_directories(folder, trouble);
  if (trouble)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot be written: {}", folder.string(), trouble.message())};
  if (!std::filesystem::is_empty(folder, trouble))
    return Error{ErrorKind::invalid,
                 fmt::format("{}: is not empty, and nothing in it is replaced; name a new folder",
                             folder.string())};
  return {};
}

}  // namespace

Result<void> write_campaign_folder(const std::filesystem::path& folder, const ImportData& data,
                                   const ImportWanted& wanted) {
  if (auto good = expect_new(folder); !good) return good;
  for (const ImportRun& run : data.runs) {
    if (auto done = write_run(folder / file_of(run), run); !done) return done;
  }
  Json facts = Json::object();
  for (const auto& [name, value] : data.facts)
    facts[name] = value;
  if (!data.left_out.empty()) facts["left_out"] = data.left_out;
  if (auto done = write_json(folder / "import.json", facts); !done) return done;
  if (const Json model = Json::parse(data.model_json, nullptr, false); model.is_object()) {
    if (auto done = write_json(folder / "model.json", model); !done) return done;
  }
  // The last file: a folder without it is no campaign.
  return write_json(folder / "campaign.json", campaign_json(data, wanted));
}

}  // namespace shaker::cli
