// Tracks the progress of a campaign from the documents of the stream. It does not read a clock:
// the caller passes the time in seconds, from any origin.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/campaign.hpp"

namespace shaker::cli {

class CampaignProgress {
 public:
  explicit CampaignProgress(const config::CampaignSpec& campaign) : campaign_(campaign) {}

  // Updates the state from one document. `now`: the present time, s.
  void take(const nlohmann::json& document, double now);

  // True when the campaign had begun (a state other than IDLE and FAULT), the rig is in IDLE or
  // FAULT again, and its run is closed. After a trip the alarm and the end of the run follow
  // the FAULT; they are awaited for kLongestFarewell at most.
  bool over() const {
    return begun_ && at_rest() && (!run_open_ || last_ - rest_since_ > kLongestFarewell);
  }
  // True when every run ended with success and the rig is not in FAULT.
  bool success() const;
  // True when there is an estimate for every accepted cycle.
  bool estimate_is_in() const { return estimates_ >= accepted_total_; }

  double fraction() const;          // accepted cycles over the requested ones, 0 to 1
  double eta_s(double now) const;   // remaining time, including ramps and settling
  std::string status_line() const;  // "slow 1.5 Hz  MEASURE  7/20 cycles"
  const std::string& state() const { return state_; }
  // Why the campaign did not succeed: the reason of the first run that failed, otherwise the
  // reason of the rig's state.
  const std::string& reason() const { return failure_.empty() ? reason_ : failure_; }
  const nlohmann::json& last_estimate() const { return estimate_; }

 private:
  static constexpr double kLongestFarewell = 6.0;  // s
  bool at_rest() const { return state_ == "IDLE" || state_ == "FAULT"; }

  const config::CampaignSpec& campaign_;
  std::string state_, reason_, failure_;
  bool begun_ = false, run_open_ = false;
  double last_ = 0.0, rest_since_ = 0.0;
  int run_ = -1;      // index of the current run
  int accepted_ = 0;  // of the current run
  int accepted_total_ = 0, estimates_ = 0;
  int successes_ = 0;
  double run_began_ = 0.0;
  double overhead_ = -1.0;  // seconds from a run's start to its first accepted cycle
  nlohmann::json estimate_;
};

}  // namespace shaker::cli
