#include "estimator/discrepancy/cycles/cut_campaign.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace shaker::estimator::discrepancy {

Result<std::vector<SteadyRun>> cut_campaign(const Campaign& campaign, const Drifts& drifts,
                                            std::vector<std::string>& warnings) {
  std::vector<SteadyRun> runs;
  std::string first_trouble;
  for (const Recording& recording : campaign.runs) {
    SteadyOptions options;
    if (const auto known = drifts.find(recording.name); known != drifts.end())
      options.drift = known->second;
    auto run = steady_cycles(recording, options);
    if (!run && run.error().kind == ErrorKind::invalid) return run.error();
    if (!run) {
      if (first_trouble.empty()) first_trouble = run.error().what;
      warnings.push_back(run.error().what + " (this run is left out)");
      continue;
    }
    warnings.insert(warnings.end(), run->warnings.begin(), run->warnings.end());
    if (run->subharmonic > 0) {
      if (first_trouble.empty()) first_trouble = run->warnings.back();
      warnings.push_back(
          fmt::format("run {} is left out: it has no periodic solution of one cycle", run->name));
      continue;
    }
    runs.push_back(std::move(*run));
  }
  if (std::none_of(runs.begin(), runs.end(), [](const auto& r) { return r.role == Role::fit; }))
    return Error{ErrorKind::not_converged, "no run can be used: " + first_trouble};
  return runs;
}

}  // namespace shaker::estimator::discrepancy
