#include "daemon/safety/self_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace shaker::daemon {
namespace {

using protocol::Channel;

constexpr double kFewestPerPeriod = 20.0;  // five samples for each of four harmonics
constexpr double kNoisyPart = 0.01;        // of the allowed range of stroke
constexpr double kRestlessPart = 0.2;      // of the first run's amplitude
constexpr double kBadPart = 0.05;          // largest part of bad samples
constexpr double kAliveS = 0.2;            // the largest age of a sample at rest
constexpr double kUndetermined = 0.03;     // |sin| of the lag: sensor delays may cause it
constexpr double kMovesPart = 0.5;         // smallest part of the commanded amplitude
constexpr double kRoundedPart = 1e-6;      // the timeout may be a rounded float
constexpr double kAnswers = 5.0;           // times the noise of a point: smallest response
constexpr double kLeastStroke = 1e-7;      // m; lower limit for a sensor without noise

double fastest(const config::CampaignSpec& campaign) {
  double f = 0.0;
  for (const auto& run : campaign.runs)
    f = std::max(f, run.frequency_hz);
  return f;
}

// The driver's message, in brackets within a sentence.
std::string as_reason(const std::string& trouble) {
  return trouble.empty() ? std::string() : fmt::format(" ({})", trouble);
}

void check_channel(std::vector<Finding>& found, Channel channel, const ChannelMonitor& monitor,
                   const RestFacts& facts, double stale_s, double fewest_hz) {
  const auto what = protocol::name(channel);
  if (monitor.rest_count() == 0 ||
      seconds(facts.now - monitor.last_good()) > std::max(stale_s, kAliveS)) {
    found.push_back(
        {true, "check_sensor",
         monitor.rest_bad() > 0
             ? fmt::format(
                   "the {} sensor gives no good value ({} bad ones: not a number, flagged, or "
                   "out of order); check the sensor",
                   what, monitor.rest_bad())
             : fmt::format("the {} sensor is silent{}; check its power, cable and link", what,
                           as_reason(facts.sensor_trouble))});
    return;
  }
  const double bad = static_cast<double>(monitor.rest_bad());
  const double all = bad + static_cast<double>(monitor.rest_count());
  if (bad > kBadPart * all) {
    found.push_back(
        {true, "check_sensor",
         fmt::format("{:.0f} of {:.0f} {} samples are bad; check the sensor", bad, all, what)});
  }
  if (monitor.rest_rate_hz() < fewest_hz) {
    found.push_back(
        {true, "check_rate",
         fmt::format("the {} sensor gives {:.1f} samples/s; the fastest run needs {:.1f}: "
                     "raise the sensor's rate or lower the frequency",
                     what, monitor.rest_rate_hz(), fewest_hz)});
  }
}

void check_levels(std::vector<Finding>& found, const config::Limits& limits,
                  const ChannelMonitor& stroke) {
  if (stroke.rest_count() == 0) return;
  if (stroke.value() < limits.stroke_min_m || stroke.value() > limits.stroke_max_m) {
    found.push_back(
        {true, "check_level",
         fmt::format("stroke at rest is {:.4f} m, outside {:g}..{:g} m; set up the damper "
                     "or the sensor's offset",
                     stroke.value(), limits.stroke_min_m, limits.stroke_max_m)});
  }
  const double allowed = kNoisyPart * (limits.stroke_max_m - limits.stroke_min_m);
  if (stroke.rest_noise() > allowed) {
    found.push_back(
        {true, "check_noise",
         fmt::format("the stroke wanders by {:.2e} m at rest; {:.2e} m is allowed: wait "
                     "until the damper has come to rest, or check the sensor, its mounting and its "
                     "shield",
                     stroke.rest_noise(), allowed)});
  }
}

void check_deadman(std::vector<Finding>& found, const config::ExciterConfig& exciter,
                   const std::optional<double>& timeout_s) {
  if (std::holds_alternative<config::ReplayExciter>(exciter.device)) return;  // it moves no table
  if (!timeout_s) return;  // the engine proves it
  if (!(*timeout_s > 0.0)) {
    found.push_back({true, "deadman_off",
                     fmt::format("the exciter goes on when the link is lost (heartbeat timeout "
                                 "{:g}); set a timeout of at most {:g} s in the drive",
                                 *timeout_s, exciter.deadman_max_s)});
  } else if (*timeout_s > exciter.deadman_max_s * (1.0 + kRoundedPart)) {
    found.push_back(
        {true, "deadman_long",
         fmt::format("the exciter goes on for {:g} s when the link is lost; {:g} s is allowed: "
                     "shorten the heartbeat timeout in the drive, or raise deadman_max_s in the "
                     "rig file if this damper bears so much",
                     *timeout_s, exciter.deadman_max_s)});
  } else if (*timeout_s < 2.0 * exciter.heartbeat_period_s) {
    found.push_back({true, "deadman_short",
                     fmt::format("the exciter's heartbeat timeout of {:g} s is below twice the "
                                 "heartbeat period of {:g} s; lengthen it or shorten the period",
                                 *timeout_s, exciter.heartbeat_period_s)});
  }
}

void check_exciter(std::vector<Finding>& found, const config::RigConfig& rig,
                   const std::optional<drivers::ExciterStatus>& status,
                   const std::string& trouble) {
  if (!status) {
    found.push_back(
        {true, "check_exciter",
         fmt::format("the exciter does not answer{}; check its power, cable and address",
                     as_reason(trouble))});
    return;
  }
  if (status->fault != 0) {
    found.push_back(
        {true, "check_exciter",
         fmt::format("the exciter reports fault {}; clear it at the exciter", status->fault)});
  }
  if (status->running) {
    found.push_back({true, "check_exciter",
                     "the exciter runs although nothing was commanded; stop it at the exciter"});
  }
  check_deadman(found, rig.exciter, status->heartbeat_timeout_s);
}

}  // namespace

bool expects(const config::RigConfig& rig, Channel channel) {
  return std::ranges::any_of(rig.sensors, [&](const config::SensorConfig& sensor) {
    return std::ranges::count(config::channels_of(sensor), channel) > 0;
  });
}

std::vector<Finding> check_at_rest(const config::RigConfig& rig,
                                   const config::CampaignSpec& campaign, const RestFacts& facts) {
  std::vector<Finding> found;
  const double fewest = kFewestPerPeriod * fastest(campaign);
  const double stale_s = rig.limits.stale_s;
  check_channel(found, Channel::displacement, facts.displacement, facts, stale_s, fewest);
  check_levels(found, rig.limits, facts.displacement);
  if (expects(rig, Channel::excitation)) {
    check_channel(found, Channel::excitation, facts.excitation, facts, stale_s, fewest);
    const double restless = kRestlessPart * campaign.runs.front().amplitude;
    if (facts.excitation.rest_noise() > restless) {
      found.push_back(
          {true, "check_noise",
           fmt::format("the table's acceleration wanders by {:.2g} m/s^2 at rest, more than {:.2g} "
                       "({:.0f} % of the first run's amplitude); raise the amplitude, or check the "
                       "exciter and the accelerometer",
                       facts.excitation.rest_noise(), restless, 100.0 * kRestlessPart)});
    }
  } else if (facts.excitation.rest_count() == 0) {
    found.push_back(
        {false, "excitation_not_measured",
         "the excitation is not measured: tau = 0 follows the command, the drive's delay "
         "is unknown, and estimates of damping are biased by it"});
  }
  check_exciter(found, rig, facts.status, facts.exciter_trouble);
  for (const auto& [channel, calibration] : rig.calibration) {
    if (facts.today.empty() || facts.today <= calibration.due) continue;
    found.push_back(
        {false, "calibration_overdue",
         fmt::format("the calibration of the {} sensor ({}) was due on {}; have it calibrated, or "
                     "write the new dates into the rig file",
                     protocol::name(channel), calibration.serial, calibration.due)});
  }
  return found;
}

Polarity polarity(double lag_turns) {
  const double s = std::sin(2.0 * std::numbers::pi * lag_turns);
  if (std::abs(s) < kUndetermined) return Polarity::undetermined;
  return s > 0.0 ? Polarity::right : Polarity::wrong;
}

Finding polarity_finding(double lag_turns) {
  const double degrees = lag_turns > 0.5 ? 360.0 * lag_turns - 360.0 : 360.0 * lag_turns;
  if (polarity(lag_turns) == Polarity::undetermined) {
    return {false, "polarity_undetermined",
            fmt::format("the stroke lags the excitation by {:.1f} degrees, too near to 0 or 180 to "
                        "tell the sensors' polarity; make sure that compression counts positive",
                        degrees)};
  }
  return {
      true, "polarity",
      fmt::format("the stroke leads the excitation by {:.1f} degrees, which no damper does; one of "
                  "the sensors has the wrong sign (stroke is positive in compression, excitation "
                  "upward)",
                  -degrees)};
}

std::optional<Finding> check_in_motion(const AssembledCycle* cycle, double commanded,
                                       bool excitation_measured,
                                       const std::optional<PeriodFigures>& table) {
  if (excitation_measured && cycle == nullptr && table &&
      std::abs(table->fundamental) >= kMovesPart * commanded) {
    return Finding{
        true, "excitation_without_phase",
        fmt::format("the table moves as commanded, but {} samples a period with their noise and "
                    "uneven times do not tell its phase; measure the excitation faster, or excite "
                    "more slowly",
                    table->samples)};
  }
  if (excitation_measured &&
      (cycle == nullptr || cycle->measured.amplitude < kMovesPart * commanded)) {
    return Finding{
        true, "exciter_no_motion",
        fmt::format("the exciter was asked for {:.3g} m/s^2 and the table moves with {:.3g} "
                    "m/s^2; check the drive, its enable and the accelerometer",
                    commanded, cycle == nullptr ? 0.0 : cycle->measured.amplitude)};
  }
  if (cycle == nullptr || !cycle->whole ||
      cycle->stroke_amplitude <= std::max(kAnswers * cycle->point_noise, kLeastStroke)) {
    return Finding{true, "sensor_no_response",
                   excitation_measured
                       ? "the table moves and the stroke does not; check the displacement sensor"
                       : "the stroke does not answer to the excitation; check the exciter and the "
                         "displacement sensor"};
  }
  if (excitation_measured && polarity(cycle->lag_turns) != Polarity::right) {
    return polarity_finding(cycle->lag_turns);
  }
  return std::nullopt;
}

}  // namespace shaker::daemon
