// Exports a campaign to formats of other programs: CSV, MAT, UFF.
#include <cstdio>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/data/formats.hpp"

namespace shaker::cli {
namespace {

Result<std::vector<Written>> write(const ExportData& data, const ExportOptions& options) {
  if (options.format == "mat") return write_mat(data, options.directory);
  if (options.format == "uff") return write_uff(data, options.directory);
  return write_csv(data, options.samples, options.directory);
}

}  // namespace

int export_runs(const Common& common, const ExportOptions& options) {
  const auto data = read_export(options.campaign, {options.samples, options.all});
  if (!data) return fail(common, kBadInput, data.error().what);
  std::error_code code;
  std::filesystem::create_directories(options.directory, code);
  if (code)
    return fail(common, kBadInput,
                fmt::format("{}: cannot be written: {}; give a folder with --directory",
                            options.directory.string(), code.message()));
  const auto written = write(*data, options);
  if (!written) return fail(common, kBadInput, written.error().what);
  const char* what = options.format == "csv" && options.samples ? "samples" : "cycles";
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  for (const Written& each : *written) {
    nlohmann::ordered_json file = {{"file", each.file.string()}, {what, each.count}};
    if (!each.run.empty()) file["run"] = each.run;
    files.push_back(std::move(file));
    if (!common.json) fmt::print("{}: {} {}\n", each.file.string(), each.count, what);
  }
  if (common.json) {
    const nlohmann::ordered_json body = {{"campaign", data->campaign.name}, {"files", files}};
    fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  if (data->runs.empty()) return fail(common, kNegative, "the campaign has no run yet");
  return kOk;
}

}  // namespace shaker::cli
