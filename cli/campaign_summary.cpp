#include "cli/campaign_summary.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "cli/campaign_place.hpp"
#include "cli/documents_in.hpp"

namespace shaker::cli {
namespace {

Result<void> count_cycles(const record::CampaignReader& reader, RunSummary& run) {
  const auto cycles = reader.cycles(run.row.index);
  if (!cycles) return cycles.error();
  run.accepted = std::ranges::count(*cycles, true, &record::CycleRow::accepted);
  run.left_out = static_cast<long>(cycles->size()) - run.accepted;
  return {};
}

Result<void> read_documents(const record::CampaignReader& reader, CampaignSummary& summary) {
  const auto lines = reader.documents();
  if (!lines) return lines.error();
  for (const std::string& line : *lines) {
    auto document = nlohmann::json::parse(line, nullptr, false);
    const std::string type = text_of(document, "type");
    if (type == "alarm") summary.alarms.push_back(document);
    if (type == "estimate") summary.estimate = std::move(document);
  }
  return {};
}

}  // namespace

Result<CampaignSummary> summarise(const std::filesystem::path& database, bool whole) {
  const auto reader = record::CampaignReader::open(database);
  if (!reader) return reader.error();
  auto row = reader->campaign();
  if (!row) return row.error();
  const auto runs = reader->runs();
  if (!runs) return runs.error();
  CampaignSummary summary;
  summary.row = std::move(*row);
  summary.model = text_of(nlohmann::json::parse(summary.row.model_json, nullptr, false), "name");
  for (const record::RunRow& run : *runs) {
    summary.runs.push_back({run, 0, 0});
    if (!whole) continue;
    if (auto counted = count_cycles(*reader, summary.runs.back()); !counted) return counted.error();
  }
  if (!whole) return summary;
  auto facts = reader->facts();
  if (!facts) return facts.error();
  summary.facts = std::move(*facts);
  if (auto read = read_documents(*reader, summary); !read) return read.error();
  return summary;
}

Result<std::vector<std::filesystem::path>> databases_in(const std::filesystem::path& directory) {
  std::vector<std::filesystem::path> files;
  std::error_code trouble;
  for (const auto& entry : std::filesystem::directory_iterator(directory, trouble)) {
    if (is_database(entry.path())) files.push_back(entry.path());
  }
  if (trouble == std::errc::not_a_directory)
    return Error{ErrorKind::io,
                 fmt::format("{0}: is a file; `shakerctl show {0}` shows a campaign, and this "
                             "command wants the folder that holds them",
                             directory.string())};
  if (trouble)
    return Error{ErrorKind::io, fmt::format("{}: {}; give the folder that holds the campaigns",
                                            directory.string(), trouble.message())};
  std::ranges::sort(files);
  return files;
}

}  // namespace shaker::cli
