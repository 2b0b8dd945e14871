// Estimates from a campaign's folder whose runs are no periodic responses: motions of a dynamometer,
// drops, decays, sweeps.
#include <algorithm>

#include <fmt/format.h>

#include "cli/commands.hpp"
#include "cli/opened_campaign.hpp"
#include "estimator/diagnosis/estimate_campaign.hpp"
#include "protocol/documents.hpp"
#include "report/estimate_document.hpp"
#include "report/estimate_table.hpp"

namespace shaker::cli {
namespace {

// The first option that is for mean cycles only; empty: none is given.
std::string for_mean_cycles(const EstimateOptions& options) {
  const EstimateOptions usual;
  if (options.starts != usual.starts) return "--starts";
  if (options.accuracy != usual.accuracy) return "--accuracy";
  if (options.intervals != usual.intervals) return "--intervals";
  if (options.loss != usual.loss) return "--loss";
  if (!options.objective.empty()) return "--objective";
  if (!options.noise.empty()) return "--noise";
  if (!options.periods.empty()) return "--periods";
  if (options.bias != usual.bias) return "--bias";
  if (options.frequency_hz) return "--frequency";
  if (options.amplitude) return "--amplitude";
  return {};
}

}  // namespace

bool holds_records(const EstimateOptions& options) {
  if (options.files.empty() || options.model.empty() ||
      std::any_of(options.files.begin(), options.files.end(),
                  [](const auto& file) { return place_of(file) != Place::folder; }))
    return false;
  const auto opened = open_campaigns(options.files, options.model);
  return opened && std::any_of(opened->campaign.runs.begin(), opened->campaign.runs.end(),
                               [](const estimator::diagnosis::Recording& run) {
                                 return run.kind != estimator::diagnosis::Kind::periodic;
                               });
}

int estimate_records(const Common& common, const EstimateOptions& options) {
  if (const auto option = for_mean_cycles(options); !option.empty())
    return fail(common, kBadInput,
                fmt::format("{} is for periodic responses, and {} holds other runs: leave it out",
                            option, options.names()));
  const auto opened = open_campaigns(options.files, options.model);
  if (!opened) return fail(common, kBadInput, opened.error().what);
  if (auto good = check_units(opened->model); !good)
    return fail(common, kBadInput, good.error().what);
  const auto estimate = estimator::diagnosis::estimate_campaign(opened->campaign, opened->model);
  if (!estimate)
    return fail(common, estimate.error().kind == ErrorKind::invalid ? kBadInput : kNotUsable,
                estimate.error().what);
  protocol::EstimateDocument document = report::to_document(*estimate);
  document.campaign = opened->campaign.name;
  document.clock = "recorded";
  fmt::print("{}", common.json ? protocol::to_json_text(document) + "\n"
                               : report::estimate_table(document));
  if (document.usable) return document.intervals_hold ? kOk : kIntervals;
  if (!common.json) fmt::print(stderr, "shakerctl: the estimate is not usable\n");
  return kNotUsable;
}

}  // namespace shaker::cli
