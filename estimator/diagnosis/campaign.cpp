#include "estimator/diagnosis/campaign.hpp"

#include <utility>

#include <fmt/format.h>

namespace shaker::estimator::diagnosis {

void add_cycles(Campaign& campaign, Recording run, double reference_mass) {
  if (run.t.empty()) {
    campaign.warnings.push_back(
        fmt::format("run {} has no accepted cycle and is left out", run.name));
    return;
  }
  if (!run.force.empty() && !(reference_mass > 0.0)) {
    campaign.warnings.push_back(fmt::format(
        "run {}: its load cell is not used, because the mass that it carries is not known: give "
        "\"reference_mass\", in kg, in the campaign's file",
        run.name));
    run.force.clear();
  }
  for (double& force : run.force)
    force /= reference_mass;
  campaign.runs.push_back(std::move(run));
}

}  // namespace shaker::estimator::diagnosis
