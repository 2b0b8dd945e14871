#include "cli/missing_runs.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

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

// A database and the campaign in it.
struct Held {
  CampaignSummary summary;
  config::CampaignSpec campaign;
};

Result<Held> held_in(const std::filesystem::path& database) {
  if (auto good = expect_file(database); !good) return good.error();
  auto summary = summarise(database, true);
  if (!summary) return summary.error();
  auto campaign =
      config::parse_campaign(summary->row.spec_json, database.string() + " (its campaign)", "/");
  if (!campaign) return campaign.error();
  return Held{std::move(*summary), std::move(*campaign)};
}

// Runs of another damper or rig say nothing about what this campaign lacks.
Result<void> expect_same(const Held& first, const Held& other,
                         const std::filesystem::path& database) {
  const auto compare = [&](const char* what, const std::string& is,
                           const std::string& was) -> Result<void> {
    if (is == was) return {};
    return Error{ErrorKind::invalid,
                 fmt::format("{}: {} \"{}\", and the first database has \"{}\"; give databases of "
                             "one campaign",
                             database.string(), what, is, was)};
  };
  if (auto same = compare("holds the campaign", other.campaign.name, first.campaign.name); !same)
    return same;
  if (auto same = compare("was measured on the rig", other.summary.row.rig, first.summary.row.rig);
      !same)
    return same;
  const std::string& serial = other.campaign.specimen.serial;
  const std::string& first_serial = first.campaign.specimen.serial;
  if (serial.empty() || first_serial.empty()) return {};
  return compare("has the serial number", serial, first_serial);
}

}  // namespace

Result<MissingRuns> missing_runs(const std::vector<std::filesystem::path>& databases) {
  std::optional<Held> first;
  std::vector<CampaignSummary> summaries;
  std::string names;
  for (const auto& database : databases) {
    auto held = held_in(database);
    if (!held) return held.error();
    if (!first) first = *held;
    if (auto same = expect_same(*first, *held, database); !same) return same.error();
    summaries.push_back(std::move(held->summary));
    names += (names.empty() ? "" : ", ") + database.filename().string();
  }
  MissingRuns missing{std::move(first->campaign), first->summary.row.rig};
  std::erase_if(missing.campaign.runs,
                [&](const config::RunSpec& run) { return is_measured(summaries, run); });
  missing.campaign.resumes = names;
  return missing;
}

}  // namespace shaker::cli
