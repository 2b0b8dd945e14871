// How the estimator is to fit a campaign. Pure; builds no model, so that the engine may call it.
#pragma once

#include <string>

#include "config/campaign.hpp"
#include "estimator/online/online_estimator.hpp"

namespace shaker::daemon {

estimator::OnlineOptions estimator_options(const config::CampaignSpec& campaign);

// What an operator should know before the estimates of the campaign; empty if there is nothing.
std::string remark(const config::CampaignSpec& campaign);

}  // namespace shaker::daemon
