// Searches for what a model lacks: runs the diagnosis on a campaign.
#include "estimator/diagnosis/diagnose.hpp"

#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/heap.hpp"
#include "cli/campaign_title.hpp"
#include "cli/commands.hpp"
#include "cli/diagnosed_data.hpp"
#include "cli/opened_campaign.hpp"
#include "cli/terminal.hpp"
#include "report/diagnosis_document.hpp"
#include "report/diagnosis_files.hpp"

namespace shaker::cli {
namespace {

estimator::diagnosis::Progress progress_line() {
  if (!stdout_is_terminal()) return {};
  return [](std::string_view stage, double share) {
    fmt::print(stderr, "\r{:<24} {}\x1b[K", stage, progress_bar(share, 30));
    if (share >= 1.0) fmt::print(stderr, "\r\x1b[K");
    std::fflush(stderr);
  };
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
  if (options.campaigns.empty())
    return fail(
        common, kBadInput,
        "diagnose needs a campaign: a folder with campaign.json, or FILE.db (with --daemon, "
        "it takes the newest)");
  keep_freed_memory();
  auto opened = open_campaigns(options.campaigns, options.model);
  if (!opened) return fail(common, kBadInput, opened.error().what);
  if (!options.out.empty()) {
    if (auto ready = report::prepare_diagnosis(options.out, options.model); !ready)
      return fail(common, kBadInput, ready.error().what);
    warn_of_earlier_files(options.out);
  }
  estimator::diagnosis::DiagnoseOptions wanted;
  wanted.false_alarm_rate = options.false_alarm_rate;
  if (options.thorough) wanted.evaluation_budget = estimator::diagnosis::kThorough;
  using estimator::diagnosis::CalibrationCache;
  CalibrationCache calibrations(CalibrationCache::user_folder());
  wanted.calibrations = &calibrations;
  auto found =
      estimator::diagnosis::diagnose(opened->campaign, opened->model, wanted, progress_line());
  if (!found) {
    return fail(common, found.error().kind == ErrorKind::invalid ? kBadInput : kNotUsable,
                found.error().what);
  }
  fmt::print("{}",
             common.json ? report::diagnosis_json(*found) + "\n" : report::diagnosis_table(*found));
  if (options.out.empty()) return kOk;
  put_origin(opened->campaign, options.campaigns, found->damper);
  const auto written = report::write_diagnosis(
      options.out, *found,
      campaign_title(options.campaigns, opened->row, "diagnosed", {{}, {}, {}, {}, options.model}));
  // The result has been printed; as JSON it must stay the only document on stdout.
  return written ? kOk : fail({}, kBadInput, written.error().what);
}

}  // namespace shaker::cli
