// Searches for what a model lacks: runs the diagnosis on a campaign.
#include "estimator/discrepancy/diagnose.hpp"

#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/heap.hpp"
#include "cli/campaign_folder.hpp"
#include "cli/campaign_place.hpp"
#include "cli/commands.hpp"
#include "cli/diagnosis_title.hpp"
#include "cli/terminal.hpp"
#include "record/campaign_database.hpp"
#include "report/diagnosis_document.hpp"
#include "report/diagnosis_files.hpp"

namespace shaker::cli {
namespace {

estimator::discrepancy::Progress progress_line() {
  if (!stdout_is_terminal()) return {};
  return [](std::string_view stage, double share) {
    fmt::print(stderr, "\r{:<24} {}\x1b[K", stage, progress_bar(share, 30));
    if (share >= 1.0) fmt::print(stderr, "\r\x1b[K");
    std::fflush(stderr);
  };
}

// What a database says of itself; none for a folder.
Result<std::optional<record::CampaignRow>> row_of(const std::filesystem::path& campaign) {
  std::optional<record::CampaignRow> none;
  if (!is_database(campaign)) return none;
  const auto reader = record::CampaignReader::open(campaign);
  if (!reader) return reader.error();
  auto row = reader->campaign();
  if (!row) return row.error();
  return std::optional(std::move(*row));
}

// The model file that was given, or the model that a database holds.
Result<config::ModelSpec> model_to_start_from(const DiagnoseCommandOptions& options,
                                              const std::optional<record::CampaignRow>& row) {
  if (!options.model.empty()) return config::load_model(options.model);
  if (row) return config::parse_model(row->model_json, options.campaign.string() + " (its model)");
  return Error{ErrorKind::invalid,
               fmt::format("{}: only a campaign database (.db) knows its model; give --model "
                           "MODEL.json",
                           options.campaign.string())};
}

// Says which files of an earlier diagnosis will be replaced.
void warn_of_earlier_files(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& file : report::earlier_diagnosis(folder))
    names.push_back(file.filename().string());
  if (names.empty()) return;
  fmt::print(stderr, "shakerctl: {} holds an earlier diagnosis: {} will be replaced\n",
             folder.string(), fmt::join(names, ", "));
}

}  // namespace

int diagnose(const Common& common, const DiagnoseCommandOptions& options) {
  if (options.job) return diagnose_job();
  if (options.daemon) return diagnose_by_daemon(common, options);
  if (options.campaign.empty())
    return fail(
        common, kBadInput,
        "diagnose needs a campaign: a folder with campaign.json, or FILE.db (with --daemon, "
        "it takes the newest)");
  keep_freed_memory();
  const auto row = row_of(options.campaign);
  if (!row) return fail(common, kBadInput, row.error().what);
  auto model = model_to_start_from(options, *row);
  if (!model) return fail(common, kBadInput, model.error().what);
  auto campaign = read_campaign(options.campaign, *model);
  if (!campaign) return fail(common, kBadInput, campaign.error().what);
  if (!options.out.empty()) {
    if (auto ready = report::prepare_diagnosis(options.out, options.model); !ready)
      return fail(common, kBadInput, ready.error().what);
    warn_of_earlier_files(options.out);
  }
  estimator::discrepancy::DiagnoseOptions wanted;
  wanted.false_alarm_rate = options.false_alarm_rate;
  if (options.thorough) wanted.effort = estimator::discrepancy::kThorough;
  using estimator::discrepancy::CalibrationCache;
  CalibrationCache calibrations(CalibrationCache::user_folder());
  wanted.calibrations = &calibrations;
  const auto found = estimator::discrepancy::diagnose(*campaign, *model, wanted, progress_line());
  if (!found) {
    return fail(common, found.error().kind == ErrorKind::invalid ? kBadInput : kNotUsable,
                found.error().what);
  }
  fmt::print("{}",
             common.json ? report::diagnosis_json(*found) + "\n" : report::diagnosis_table(*found));
  if (options.out.empty()) return kOk;
  const auto written =
      report::write_diagnosis(options.out, *found, title_of(options.campaign, *row));
  // The result has been printed; as JSON it must stay the only document on stdout.
  return written ? kOk : fail({}, kBadInput, written.error().what);
}

}  // namespace shaker::cli
