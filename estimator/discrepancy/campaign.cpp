#include "estimator/discrepancy/campaign.hpp"

#include <utility>

#include <fmt/format.h>

namespace shaker::estimator::discrepancy {

void add_cycles(Campaign& campaign, std::string name, const CycleSetting& setting,
                std::vector<double> t, std::vector<double> displacement,
                std::vector<double> excitation) {
  if (t.empty()) {
    campaign.warnings.push_back(fmt::format("run {} has no accepted cycle and is left out", name));
    return;
  }
  Recording run;
  run.name = std::move(name);
  run.frequency_hz = setting.frequency_hz;
  run.amplitude = setting.amplitude;
  run.t = std::move(t);
  run.displacement = std::move(displacement);
  run.excitation = std::move(excitation);
  campaign.runs.push_back(std::move(run));
}

}  // namespace shaker::estimator::discrepancy
