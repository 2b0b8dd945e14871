// The option `--periods`: after how many periods of the excitation the response of a run
// repeats.
//
// The operator gives it with the estimate and not in the campaign file, because it is a finding
// about a measured response and not a setting of the rig. The daemon does not use it, because
// it estimates from responses of one period.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::cli {

struct PeriodsOfRuns {
  int all = 1;
  std::map<std::string, int> named;  // by the run's name; overrides `all`
  bool asked() const { return all > 1 || !named.empty(); }
  int of(const std::string& run) const;
};

// Parses words "M", for all runs, or "RUN=M". An Error quotes the wrong word.
Result<PeriodsOfRuns> parse_periods(const std::vector<std::string>& words);

}  // namespace shaker::cli
