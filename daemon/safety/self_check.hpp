// The checks before a run: conditions before any motion, and conditions on the first gentle
// motion.
//
// At rest: the sensors are alive with a plausible rate, quiet and within limits; the exciter
// answers without a fault and does not move; its dead-man is on and acts within deadman_max_s.
// If the timeout cannot be read back, the engine proves the dead-man; a replay needs none. In
// gentle motion: the table moves, and the stroke answers with the right sign.
//
// The sign: a damper dissipates power. Over a whole period the excitation does the work of the
// damping, mean(x du/dt) > 0, for every passive damper and at every frequency. Therefore the
// fundamental of the stroke lags that of the excitation by 0 to 180 degrees: nearly in phase
// below the resonance and nearly opposite above it. A sensor of wrong polarity shows a lead.
// Within 1.7 degrees of either end the result is "undetermined". Pure functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "config/campaign.hpp"
#include "config/rig.hpp"
#include "daemon/cycles/cycle_assembler.hpp"
#include "daemon/safety/channel_monitor.hpp"
#include "daemon/safety/period_watch.hpp"
#include "drivers/exciter.hpp"

namespace shaker::daemon {

struct Finding {
  bool fatal = false;  // the campaign must not continue
  std::string code;    // of the alarm
  std::string text;
};

// True if the rig file has a sensor for the channel.
bool expects(const config::RigConfig& rig, protocol::Channel channel);

struct RestFacts {
  Nanoseconds now{};
  const ChannelMonitor& displacement;
  const ChannelMonitor& excitation;
  std::optional<drivers::ExciterStatus> status;  // read after the check began
  // Last message of each link, for a silent device; may be empty.
  std::string sensor_trouble = {}, exciter_trouble = {};
  std::string today = {};  // "2026-03-01"; empty: calibrations are not looked at
};
std::vector<Finding> check_at_rest(const config::RigConfig& rig,
                                   const config::CampaignSpec& campaign, const RestFacts& facts);

// Call after some periods at the gentle level. `cycle` is the last one, null if there was none;
// then `table` has the figures of a period of the measured excitation, if known. `commanded` in
// m/s^2.
std::optional<Finding> check_in_motion(const AssembledCycle* cycle, double commanded,
                                       bool excitation_measured,
                                       const std::optional<PeriodFigures>& table = {});

enum class Polarity { right, wrong, undetermined };
Polarity polarity(double lag_turns);
Finding polarity_finding(double lag_turns);  // precondition: the polarity is not `right`

}  // namespace shaker::daemon
