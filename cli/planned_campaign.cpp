#include "cli/planned_campaign.hpp"

#include <algorithm>
#include <ranges>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/data/out_file.hpp"
#include "config/campaign.hpp"

namespace shaker::cli {
namespace {

Error not_written(const std::filesystem::path& file, const std::string& why) {
  return {ErrorKind::invalid, fmt::format("{}: {}", file.string(), why)};
}

// The sets are in the order of their sizes, the best of each size first. With an aim, the best of all
// sizes.
const estimator::PlanSet* best_of_largest(const estimator::Plan& plan) {
  const estimator::PlanSet* best = nullptr;
  for (const estimator::PlanSet& set : plan.sets) {
    const bool better =
        best == nullptr || (set.aim_error > 0.0 ? set.aim_over_prior < best->aim_over_prior
                                                : set.runs.size() > best->runs.size());
    if (set.determined && better) best = &set;
  }
  return best;
}

// Without the last digits, which a change of the unit makes.
double plain(double value) {
  return std::stod(fmt::format("{:.10g}", value));
}

}  // namespace

Result<void> write_planned_campaign(const std::filesystem::path& file,
                                    const config::ModelSpec& model, const estimator::Plan& plan,
                                    const estimator::PlanOptions& options) {
  std::error_code none;
  if (std::filesystem::exists(file, none))
    return not_written(file, "exists, and is not replaced; name another file");
  const estimator::PlanSet* set = best_of_largest(plan);
  if (set == nullptr)
    return not_written(file,
                       "is not written: no set of runs determines all parameters; allow more runs "
                       "with --runs, or fix a parameter of the model");
  const auto to_si = conversion(model.length_unit + "/s^2", "m/s^2");
  if (!to_si)
    return not_written(file,
                       fmt::format("is not written: a campaign's amplitudes are in m/s^2, and "
                                   "the model counts in {}",
                                   model.length_unit));
  config::CampaignSpec campaign;
  campaign.name = fmt::format("plan for {}", model.name);
  std::ranges::replace(campaign.name, '/', '_');
  campaign.model = model;
  campaign.points_per_cycle = options.points;
  for (std::size_t i = 0; i < set->runs.size(); ++i) {
    const estimator::PlanCandidate& candidate = plan.candidates[set->runs[i]];
    campaign.runs.push_back(
        {fmt::format("r{:02}", campaign.runs.size() + 1), plain(candidate.frequency_hz),
         plain(to_si->scale * candidate.amplitude), std::max(1, static_cast<int>(set->cycles[i]))});
  }
  OutFile out(file);
  out.write("{}", config::to_json_text(campaign));
  return out.finish();
}

}  // namespace shaker::cli
