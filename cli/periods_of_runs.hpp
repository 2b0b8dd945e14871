// What `--periods` says: after how many periods of the excitation a run's response repeats.
//
// An operator says it with the estimate and not the campaign's file: it is a finding about a
// response that was measured, not a setting of the rig, and the daemon, whose estimates are of
// responses of one period, has no use for it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::cli {

struct PeriodsOfRuns {
  int all = 1;
  std::map<std::string, int> named;  // by the run's name; wins over `all`
  bool asked() const { return all > 1 || !named.empty(); }
  int of(const std::string& run) const;
};

// Words "M", for all runs, or "RUN=M". An Error says what else was found.
Result<PeriodsOfRuns> parse_periods(const std::vector<std::string>& words);

}  // namespace shaker::cli
