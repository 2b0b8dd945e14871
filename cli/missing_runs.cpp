#include "cli/missing_runs.hpp"

#include <algorithm>

#include "cli/campaign_place.hpp"
#include "cli/campaign_summary.hpp"

namespace shaker::cli {
namespace {

bool same_dwell(const record::RunRow& row, const config::RunSpec& run) {
  return row.name == run.name && row.frequency_hz == run.frequency_hz &&
         row.amplitude == run.amplitude;
}

bool is_measured(const std::vector<CampaignSummary>& summaries, const config::RunSpec& run) {
  return std::ranges::any_of(summaries, [&](const CampaignSummary& summary) {
    return std::ranges::any_of(summary.runs, [&](const RunSummary& measured) {
      return same_dwell(measured.row, run) && measured.accepted >= run.cycles;
    });
  });
}

}  // namespace

Result<config::CampaignSpec> missing_runs(const std::vector<std::filesystem::path>& databases) {
  std::vector<CampaignSummary> summaries;
  std::string names;
  for (const auto& database : databases) {
    if (auto good = expect_file(database); !good) return good.error();
    auto summary = summarise(database, true);
    if (!summary) return summary.error();
    summaries.push_back(std::move(*summary));
    names += (names.empty() ? "" : ", ") + database.filename().string();
  }
  auto campaign = config::parse_campaign(summaries.front().row.spec_json,
                                         databases.front().string() + " (its campaign)", "/");
  if (!campaign) return campaign.error();
  std::erase_if(campaign->runs,
                [&](const config::RunSpec& run) { return is_measured(summaries, run); });
  campaign->resumes = names;
  return campaign;
}

}  // namespace shaker::cli
