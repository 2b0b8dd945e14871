// How far a campaign is, from the documents of the stream. Pure: time comes in by call, in seconds
// since any origin.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/campaign.hpp"

namespace shaker::cli {

class CampaignProgress {
 public:
  explicit CampaignProgress(const config::CampaignSpec& campaign) : campaign_(campaign) {}

  void take(const nlohmann::json& document, double now);

  // It had begun (a state other than IDLE), is in IDLE or FAULT again, and its run has been closed:
  // on a trip the alarm and the run's end follow the FAULT. Not waited for longer than a few
  // seconds.
  bool over() const {
    return begun_ && at_rest() && (!run_open_ || last_ - rest_since_ > kLongestFarewell);
  }
  // Every run ended with success, and the rig is not in FAULT.
  bool success() const;
  // The estimate of the last accepted cycle has come.
  bool estimate_is_in() const { return estimates_ >= accepted_total_; }

  double fraction() const;          // of the cycles wanted
  double eta_s(double now) const;   // what remains, ramps and settling included
  std::string status_line() const;  // "slow 1.5 Hz  MEASURE  7/20 cycles"
  const std::string& state() const { return state_; }
  // Why it did not succeed: what the first run that failed said, else why the rig is where it is.
  const std::string& reason() const { return failure_.empty() ? reason_ : failure_; }
  const nlohmann::json& last_estimate() const { return estimate_; }

 private:
  static constexpr double kLongestFarewell = 6.0;  // s
  bool at_rest() const { return state_ == "IDLE" || state_ == "FAULT"; }

  const config::CampaignSpec& campaign_;
  std::string state_, reason_, failure_;
  bool begun_ = false, run_open_ = false;
  double last_ = 0.0, rest_since_ = 0.0;
  int run_ = -1;      // index of the current one
  int accepted_ = 0;  // of the current run
  int accepted_total_ = 0, estimates_ = 0;
  int successes_ = 0;
  double run_began_ = 0.0;
  double overhead_ = -1.0;  // seconds from a run's start to its first accepted cycle
  nlohmann::json estimate_;
};

}  // namespace shaker::cli
