// campaigns: the campaign databases of a directory, the newest last.
#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/campaign_summary.hpp"
#include "cli/commands.hpp"
#include "cli/documents_in.hpp"
#include "cli/utc_text.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

// A database, or why it cannot be read.
struct ListedCampaign {
  std::filesystem::path file;
  Result<CampaignSummary> summary;
};

std::string started(const ListedCampaign& listed) {
  return listed.summary ? listed.summary->row.started_utc : "";
}

void print_table(const std::vector<ListedCampaign>& all, const std::filesystem::path& directory) {
  std::vector<std::vector<std::string>> rows = {
      {"started", "campaign", "rig", "model", "runs", "status", "file"}};
  for (const ListedCampaign& listed : all) {
    if (!listed.summary) continue;
    const CampaignSummary& s = *listed.summary;
    rows.push_back({readable_utc(s.row.started_utc), printable(s.row.name), printable(s.row.rig),
                    printable(s.model), std::to_string(s.runs.size()), printable(s.row.status),
                    listed.file.filename().string()});
  }
  if (rows.size() > 1)
    fmt::print("{}", report::text_table(rows, {false, false, false, false, true, false, false}));
  else
    fmt::print("{} holds no campaign yet.\n", directory.string());
  std::fflush(stdout);
  for (const ListedCampaign& listed : all) {
    if (!listed.summary) fmt::print(stderr, "warning: {}\n", listed.summary.error().what);
  }
}

void print_json(const std::vector<ListedCampaign>& all, const std::filesystem::path& directory) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const ListedCampaign& listed : all) {
    nlohmann::ordered_json entry = {{"file", listed.file.string()}};
    if (listed.summary) {
      const CampaignSummary& s = *listed.summary;
      entry["campaign"] = s.row.name;
      entry["rig"] = s.row.rig;
      entry["model"] = s.model;
      entry["started_utc"] = s.row.started_utc;
      entry["finished_utc"] = s.row.finished_utc;
      entry["status"] = s.row.status;
      entry["runs"] = s.runs.size();
    } else {
      entry["error"] = listed.summary.error().what;
    }
    list.push_back(std::move(entry));
  }
  const nlohmann::ordered_json body = {{"directory", directory.string()}, {"campaigns", list}};
  fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace

int campaigns(const Common& common, const CampaignsOptions& options) {
  const auto files = databases_in(options.directory);
  if (!files) return fail(common, kBadInput, files.error().what);
  std::vector<ListedCampaign> all;
  for (const auto& file : *files)
    all.push_back({file, summarise(file, false)});
  std::ranges::stable_sort(all, {}, started);
  if (common.json)
    print_json(all, options.directory);
  else
    print_table(all, options.directory);
  return kOk;
}

}  // namespace shaker::cli
