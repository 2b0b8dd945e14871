#include "estimator/diagnosis/cycles/internal/cut_campaign.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/record_checks.hpp"

namespace shaker::estimator::diagnosis {

Result<std::vector<SteadyRun>> cut_campaign(const Campaign& campaign, const Drifts& drifts,
                                            std::vector<std::string>& warnings) {
  std::vector<SteadyRun> runs;
  std::string first_trouble;
  std::string slips;
  std::size_t slipping = 0;
  for (const Recording& recording : campaign.runs) {
    SteadyOptions options;
    if (const auto known = drifts.find(recording.name); known != drifts.end())
      options.drift = known->second;
    auto run = steady_cycles(recording, options);
    if (!run && run.error().kind == ErrorKind::invalid) return run.error();
    if (!run) {
      if (first_trouble.empty()) first_trouble = run.error().what;
      if (run.error().what.find(kTwoClocks) != std::string::npos && ++slipping == 1)
        slips = run.error().what;
      warnings.push_back(run.error().what + " (this run is left out)");
      continue;
    }
    warnings.insert(warnings.end(), run->warnings.begin(), run->warnings.end());
    if (run->subharmonic > 0) {
      if (first_trouble.empty()) first_trouble = run->warnings.back();
      warnings.push_back(fmt::format(
          "run {} is left out: {}", run->name,
          run->dying ? "it has not settled" : "it has no periodic solution of one cycle"));
      continue;
    }
    runs.push_back(std::move(*run));
  }
  if (std::none_of(runs.begin(), runs.end(), [](const auto& r) { return r.role == Role::fit; }))
    return Error{ErrorKind::not_converged, "no run can be used: " + first_trouble};
  // The others' are then not on one either: they are too short, or too slow, to show it.
  if (2 * slipping > campaign.runs.size())
    return Error{ErrorKind::not_converged,
                 fmt::format("{} of {} runs slip, and nothing can be said of what is missing: {}",
                             slipping, campaign.runs.size(), slips)};
  return runs;
}

}  // namespace shaker::estimator::diagnosis
