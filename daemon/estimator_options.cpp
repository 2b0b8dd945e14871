#include "daemon/estimator_options.hpp"

#include <vector>

#include "estimator/model/run_models.hpp"

namespace shaker::daemon {
namespace {

// Of all runs. Empty where the model lets no parameter differ between runs, or where a run lacks
// what that needs: then `lacks` says so.
std::vector<config::RunCondition> conditions_of(const config::CampaignSpec& campaign,
                                                std::string& lacks) {
  if (!estimator::varies_by_run(campaign.model)) return {};
  std::vector<config::RunCondition> all;
  for (const config::RunSpec& run : campaign.runs) {
    all.push_back(run.condition);
    all.back().run = run.name;
  }
  lacks = estimator::lacking_condition(campaign.model, all);
  if (!lacks.empty()) all.clear();
  return all;
}

}  // namespace

estimator::OnlineOptions estimator_options(const config::CampaignSpec& campaign) {
  std::string lacks;
  estimator::OnlineOptions options;
  options.runs = conditions_of(campaign, lacks);
  options.forgetting = campaign.forgetting;
  options.false_alarms_per_cycle = campaign.false_alarms_per_cycle();
  return options;
}

std::string remark(const config::CampaignSpec& campaign) {
  std::string lacks;
  conditions_of(campaign, lacks);
  if (lacks.empty()) return {};
  return estimator::taken_as_one(campaign.model, "the daemon") + ": " + lacks;
}

}  // namespace shaker::daemon
