// report: campaign, estimate, diagnosis and drop in one, as a page or a PDF.
#include <fstream>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/heap.hpp"
#include "cli/campaign_title.hpp"
#include "cli/commands.hpp"
#include "cli/dossier.hpp"
#include "cli/print_page.hpp"
#include "cli/same_damper.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;
using estimator::diagnosis::CalibrationCache;
using estimator::diagnosis::Diagnosis;

bool wants_drop(const DropOptions& drop) {
  return drop.sink_speed || !drop.rule.empty();
}

Result<void> expect_new_file(const ReportOptions& options) {
  std::error_code none;
  const std::string kind = options.out.extension().string();
  if (kind != ".html" && kind != ".pdf")
    return Error{ErrorKind::invalid,
                 fmt::format("--out {}: its name must end in .html or .pdf", options.out.string())};
  if (!options.force && fs::exists(options.out, none))
    return Error{ErrorKind::invalid,
                 fmt::format("{}: is there already; name another file, or give --force",
                             options.out.string())};
  if (wants_drop(options.drop)) return {};
  const DropOptions& d = options.drop;
  if (d.mass || d.lift || !d.limits.empty() || !d.measured.empty() || d.tyre_stiffness)
    return Error{ErrorKind::invalid,
                 "how does it fall? give --sink-speed V in m/s, or --rule RULE with --weight"};
  return {};
}

Result<void> write_page(const ReportOptions& options, const std::string& page) {
  const bool pdf = options.out.extension() == ".pdf";
  const fs::path html = pdf ? fs::path(options.out.string() + ".html") : options.out;
  std::ofstream out(html, std::ios::binary);
  out << page;
  out.close();
  if (!out)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot be written; check the folder's permissions and the disk's "
                             "space",
                             html.string())};
  if (!pdf) return {};
  auto printed = print_page(html, options.out);
  std::error_code none;
  fs::remove(html, none);
  return printed;
}

Result<Diagnosis> diagnosed(const OpenedCampaign& opened) {
  CalibrationCache calibrations(CalibrationCache::user_folder());
  estimator::diagnosis::DiagnoseOptions wanted;
  wanted.calibrations = &calibrations;
  return estimator::diagnosis::diagnose(opened.campaign, opened.model, wanted);
}

int write_dossier(const Common& common, const ReportOptions& options) {
  if (auto good = expect_new_file(options); !good)
    return fail(common, kBadInput, good.error().what);
  keep_freed_memory();
  auto opened = open_campaigns(options.drop.campaigns, options.drop.model);
  if (!opened) return fail(common, kBadInput, opened.error().what);
  if (auto apart = disagreement(options.drop.campaigns, options.drop.model))
    opened->campaign.warnings.push_back(std::move(*apart));
  const auto found = diagnosed(*opened);
  if (!found)
    return fail(common, found.error().kind == ErrorKind::invalid ? kBadInput : kNotUsable,
                found.error().what);
  Dossier dossier;
  dossier.opened = &*opened;
  dossier.diagnosis = &*found;
  dossier.commands = dossier_commands(options);
  dossier.title = campaign_title(
      options.drop.campaigns, opened->row, "made",
      {options.specimen, options.serial, options.rig, options.operator_name, options.drop.model});
  std::optional<DiagnosedDrop> drop;
  if (wants_drop(options.drop)) {
    auto predicted = predict_diagnosed(options.drop, found->damper);
    if (!predicted && predicted.error().kind != ErrorKind::not_converged)
      return fail(common, kBadInput, predicted.error().what);
    if (predicted)
      drop = std::move(*predicted);
    else
      dossier.no_drop = "There is no drop: " + predicted.error().what;
  }
  dossier.drop = drop ? &*drop : nullptr;
  if (auto written = write_page(options, dossier_page(dossier)); !written)
    return fail(common, kBadInput, written.error().what);
  if (!dossier.no_drop.empty())
    fmt::print(stderr, "shakerctl: {}; the page says so\n", dossier.no_drop);
  const std::string sentence = report::diagnosis_sentence(*found);
  if (common.json) {
    const nlohmann::ordered_json body = {{"file", options.out.string()},
                                         {"verdict", name(found->verdict)},
                                         {"sentence", sentence},
                                         {"commands", dossier.commands}};
    fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    fmt::print("{}\n{}\n", sentence, options.out.string());
  }
  if (!dossier.no_drop.empty()) return kNotUsable;
  return drop && drop->joined && !drop->joined->drop.intervals_hold ? kIntervals : kOk;
}

}  // namespace

int report_campaign(const Common& common, const ReportOptions& options) {
  try {
    return write_dossier(common, options);
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
