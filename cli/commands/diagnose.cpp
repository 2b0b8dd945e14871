// What a model lacks: the discrepancy workflow on a campaign.
#include "estimator/discrepancy/diagnose.hpp"

#include <cstdio>
#include <fstream>

#include <fmt/format.h>

#include "cli/campaign_folder.hpp"
#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "report/diagnosis_document.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::cli {
namespace {

using estimator::discrepancy::Diagnosis;

bool write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text << '\n';
  out.close();
  return static_cast<bool>(out);
}

// The files of DIR; the name of the one that could not be written, or nothing.
std::string write_all(const std::filesystem::path& folder, const Diagnosis& diagnosis) {
  std::error_code trouble;
  std::filesystem::create_directories(folder, trouble);
  if (trouble) return fmt::format("{}: {}", folder.string(), trouble.message());
  if (!write_file(folder / "diagnosis.json", report::diagnosis_json(diagnosis)))
    return fmt::format("{}: cannot be written", (folder / "diagnosis.json").string());
  if (!write_file(folder / "model.json", config::to_json_text(diagnosis.improved)))
    return fmt::format("{}: cannot be written", (folder / "model.json").string());
  if (!write_file(folder / "report.html", report::diagnosis_page(diagnosis)))
    return fmt::format("{}: cannot be written", (folder / "report.html").string());
  return {};
}

estimator::discrepancy::Progress progress_line() {
  if (!stdout_is_terminal()) return {};
  return [](std::string_view stage, double share) {
    fmt::print(stderr, "\r{:<24} {}\x1b[K", stage, progress_bar(share, 30));
    if (share >= 1.0) fmt::print(stderr, "\r\x1b[K");
    std::fflush(stderr);
  };
}

}  // namespace

int diagnose(const Common& common, const DiagnoseCommandOptions& options) {
  auto model = config::load_model(options.model);
  if (!model) return fail(common, kBadInput, model.error().what);
  auto campaign = read_campaign(options.campaign, *model);
  if (!campaign) return fail(common, kBadInput, campaign.error().what);
  estimator::discrepancy::DiagnoseOptions wanted;
  wanted.false_alarm_rate = options.false_alarm_rate;
  const auto found = estimator::discrepancy::diagnose(*campaign, *model, wanted, progress_line());
  if (!found) {
    return fail(common, found.error().kind == ErrorKind::invalid ? kBadInput : kNotUsable,
                found.error().what);
  }
  if (!options.out.empty()) {
    if (const std::string trouble = write_all(options.out, *found); !trouble.empty())
      return fail(common, kBadInput, trouble);
  }
  fmt::print("{}",
             common.json ? report::diagnosis_json(*found) + "\n" : report::diagnosis_table(*found));
  return kOk;
}

}  // namespace shaker::cli
