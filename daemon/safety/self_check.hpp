// The pre-run check: what must be so before anything moves, and what the first gentle motion must
// show.
//
// At rest: sensors alive with a plausible rate, quiet and within limits; the exciter answers
// without a fault and does not move; its own dead-man is on and acts within deadman_max_s (one that
// cannot be read back the engine proves; a replay moves nothing and needs none). In gentle motion:
// the table moves, the stroke answers, and with the right sign.
//
// The sign: a damper takes power, it never gives any. Over a whole period the excitation does the
// work of the damping, mean(x du/dt) > 0, for every passive damper and at every frequency, so the
// stroke's fundamental lags the excitation's by 0 to 180 degrees, in phase below the resonance and
// nearly opposite above it. A sensor of wrong polarity shows a lead. Within 1.7 degrees of either
// end nothing can be said, and it is said so. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "config/campaign.hpp"
#include "config/rig.hpp"
#include "daemon/cycles/cycle_assembler.hpp"
#include "daemon/safety/channel_monitor.hpp"
#include "drivers/exciter.hpp"

namespace shaker::daemon {

struct Finding {
  bool fatal = false;  // the campaign may not go on
  std::string code;    // of the alarm
  std::string text;
};

// True when the rig file names a sensor for the channel.
bool expects(const config::RigConfig& rig, protocol::Channel channel);

struct RestFacts {
  Nanoseconds now{};
  const ChannelMonitor& displacement;
  const ChannelMonitor& excitation;
  std::optional<drivers::ExciterStatus> status;  // read since the check began
  // What the links last said, for who is silent; empty: nothing.
  std::string sensor_trouble = {}, exciter_trouble = {};
};
std::vector<Finding> check_at_rest(const config::RigConfig& rig,
                                   const config::CampaignSpec& campaign, const RestFacts& facts);

// After some periods at the gentle level; `cycle` is the last one, null when there was none.
std::optional<Finding> check_in_motion(const AssembledCycle* cycle, double commanded,
                                       bool excitation_measured);

enum class Polarity { right, wrong, undetermined };
Polarity polarity(double lag_turns);
Finding polarity_finding(double lag_turns);  // precondition: not right

}  // namespace shaker::daemon
