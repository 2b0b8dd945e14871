#include "daemon/estimator_options.hpp"

#include <set>
#include <vector>

#include <fmt/format.h>

#include "estimator/model/run_models.hpp"

namespace shaker::daemon {
namespace {

// A fit takes all values together, and its work grows with about the cube of their number: for an
// oleo 12 take 23 ms, 30 take 0.4 s. The estimator must answer within seconds.
constexpr std::size_t kMostValues = 12;

// The number of values of the parameters that have one in each run or group.
std::size_t values_of(const config::ModelSpec& model,
                      const std::vector<config::RunCondition>& runs) {
  std::size_t count = 0;
  for (const config::EffectSpec& line : model.effects) {
    for (const auto& [symbol, parameter] : line.parameters) {
      if (parameter.variation.per.empty()) continue;
      std::set<std::string> labels;
      for (const config::RunCondition& run : runs)
        labels.insert(parameter.variation.per == "run" ? run.run : run.group);
      count += labels.size();
    }
  }
  return count;
}

// Of all runs. Empty where the model lets no parameter differ between runs, or where the estimator
// cannot follow it: then `why_not` says why.
std::vector<config::RunCondition> conditions_of(const config::CampaignSpec& campaign,
                                                std::string& why_not) {
  if (!estimator::varies_by_run(campaign.model)) return {};
  std::vector<config::RunCondition> all;
  for (const config::RunSpec& run : campaign.runs) {
    all.push_back(run.condition);
    all.back().run = run.name;
  }
  why_not = estimator::lacking_condition(campaign.model, all);
  const std::size_t values = values_of(campaign.model, all);
  if (why_not.empty() && values > kMostValues)
    why_not = fmt::format("{} values differ between the runs, and it fits {} at most", values,
                          kMostValues);
  if (why_not.empty() && values > 0 && campaign.forgetting < 1.0)
    why_not = "the campaign forgets earlier runs, and with them their values";
  if (!why_not.empty()) all.clear();
  return all;
}

}  // namespace

estimator::OnlineOptions estimator_options(const config::CampaignSpec& campaign) {
  std::string why_not;
  estimator::OnlineOptions options;
  options.runs = conditions_of(campaign, why_not);
  options.forgetting = campaign.forgetting;
  options.false_alarms_per_cycle = campaign.false_alarms_per_cycle();
  return options;
}

std::string remark(const config::CampaignSpec& campaign) {
  std::string why_not;
  conditions_of(campaign, why_not);
  if (why_not.empty()) return {};
  return fmt::format("{}: {}; `shakerctl estimate` of the campaign's database may tell them apart",
                     estimator::taken_as_one(campaign.model, "the daemon"), why_not);
}

}  // namespace shaker::daemon
