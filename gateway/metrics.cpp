#include "gateway/metrics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace shaker::gateway {
namespace {

using Json = nlohmann::json;
using Labels = std::vector<std::pair<const char*, std::string>>;

constexpr std::array kStates = {"IDLE",    "CHECK",     "RAMP",  "SETTLE",
                                "MEASURE", "RAMP_DOWN", "PAUSE", "FAULT"};

std::string escaped(const std::string& value) {
  std::string out;
  for (const char c : value) {
    if (c == '\\' || c == '"') out += '\\';
    out += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return out;
}

std::optional<double> number_at(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return std::nullopt;
  if (found->is_boolean()) return found->get<bool>() ? 1.0 : 0.0;
  if (!found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::string word_at(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

// Families in the order in which they come first, each with the samples of every rig. A family
// without a sample is left out.
class Page {
 public:
  void of_rig(const std::string& rig) { rig_ = rig; }
  void family(const char* name, const char* type, const char* help) {
    const auto found = std::ranges::find(families_, std::string_view(name), &Family::name);
    now_ = static_cast<std::size_t>(found - families_.begin());
    if (now_ == families_.size())
      families_.push_back(
          {name, fmt::format("# HELP {0} {2}\n# TYPE {0} {1}\n", name, type, help)});
  }
  void sample(std::optional<double> value, const Labels& labels = {}) {
    if (!value || !std::isfinite(*value)) return;
    std::string inside;
    const auto add = [&](const char* key, const std::string& word) {
      inside += fmt::format("{}{}=\"{}\"", inside.empty() ? "" : ",", key, escaped(word));
    };
    if (!rig_.empty()) add("rig", rig_);
    for (const auto& [key, word] : labels)
      add(key, word);
    Family& family = families_[now_];
    family.samples += family.name;
    if (!inside.empty()) family.samples += "{" + inside + "}";
    family.samples += fmt::format(" {}\n", *value);
  }
  void one(const char* name, const char* type, const char* help, std::optional<double> value) {
    family(name, type, help);
    sample(value);
  }
  std::string text() const {
    std::string all;
    for (const Family& family : families_) {
      if (!family.samples.empty()) all += family.heading + family.samples;
    }
    return all;
  }

 private:
  struct Family {
    std::string name, heading, samples = {};
  };
  std::vector<Family> families_;
  std::size_t now_ = 0;
  std::string rig_;
};

void add_state(Page& page, const Json& state) {
  page.family("shaker_state", "gauge", "1 for the state in which the rig is.");
  for (const char* name : kStates)
    page.sample(word_at(state, "state") == name ? 1.0 : 0.0, {{"state", name}});
  page.one("shaker_controlled", "gauge", "1 while somebody is in control.",
           number_at(state, "controlled"));
  page.one("shaker_unprotected", "gauge", "1 while no detector ends the motion.",
           number_at(state, "unprotected"));
  page.one("shaker_campaign_progress_ratio", "gauge", "Done part of the campaign.",
           number_at(state, "progress"));
  page.one("shaker_setpoint_hertz", "gauge", "Commanded frequency.",
           number_at(state, "frequency_hz"));
  page.one("shaker_setpoint_meters_per_second_squared", "gauge",
           "Commanded amplitude of the table's acceleration.", number_at(state, "amplitude"));
}

void add_channels(Page& page, const Json& health) {
  const auto channels = health.find("channels");
  if (channels == health.end() || !channels->is_array()) return;
  constexpr std::array kFamilies = {
      std::array{"shaker_channel_value", "Last good value, in the channel's unit.", "value"},
      std::array{"shaker_channel_age_seconds", "Age of the last good sample.", "age_s"},
      std::array{"shaker_channel_rate_hertz", "Samples a second.", "rate_hz"}};
  for (const auto& family : kFamilies) {
    page.family(family[0], "gauge", family[1]);
    for (const Json& channel : *channels) {
      if (!channel.is_object()) continue;
      const std::string name = word_at(channel, "name");
      page.sample(number_at(channel, family[2]),
                  {{"channel", name.empty() ? word_at(channel, "channel") : name},
                   {"unit", word_at(channel, "unit")}});
    }
  }
}

void add_health(Page& page, const Json& health) {
  struct Row {
    const char *name, *type, *help, *key;
  };
  constexpr Row kRows[] = {
      {"shaker_samples_total", "counter", "Samples of all sensors.", "samples"},
      {"shaker_samples_lost_total", "counter", "Samples that were lost.", "lost"},
      {"shaker_frames_malformed_total", "counter", "Frames that do not decode.", "malformed"},
      {"shaker_sensor_errors_total", "counter", "Error frames, timeouts, exceptions.", "errors"},
      {"shaker_sensor_reconnects_total", "counter", "Lost links.", "reconnects"},
      {"shaker_ring_overflows_total", "counter", "Samples that found the ring full.",
       "ring_overflows"},
      {"shaker_log_drops_total", "counter", "Lines that the log dropped.", "log_drops"},
      {"shaker_cycles_skipped_total", "counter", "Cycles that the estimator skipped.",
       "cycles_skipped"},
      {"shaker_clients", "gauge", "Clients of the daemon.", "clients"},
      {"shaker_exciter_connected", "gauge", "1 if the exciter answers.", "exciter_connected"},
      {"shaker_sensor_connected", "gauge", "1 if every sensor answers.", "sensor_connected"},
      {"shaker_loop_late_seconds", "gauge", "Largest delay of the engine's loop in a second.",
       "loop_late_max_s"},
      {"shaker_disk_free_bytes", "gauge", "Free space for campaigns.", "disk_free_bytes"},
      {"shaker_disk_flush_seconds", "gauge", "Longest flush in a second.", "disk_flush_max_s"}};
  for (const Row& row : kRows)
    page.one(row.name, row.type, row.help, number_at(health, row.key));
  add_channels(page, health);
}

void add_estimate(Page& page, const Json& estimate) {
  const auto parameters = estimate.find("parameters");
  if (parameters == estimate.end() || !parameters->is_array()) return;
  constexpr std::array kFamilies = {
      std::array{"shaker_parameter", "Estimate, in its unit.", "value"},
      std::array{"shaker_parameter_standard_error", "Its standard error.", "standard_error"}};
  for (const auto& family : kFamilies) {
    page.family(family[0], "gauge", family[1]);
    for (const Json& parameter : *parameters) {
      if (!parameter.is_object()) continue;
      page.sample(number_at(parameter, family[2]), {{"campaign", word_at(estimate, "campaign")},
                                                    {"parameter", word_at(parameter, "name")},
                                                    {"unit", word_at(parameter, "unit")}});
    }
  }
  page.one("shaker_estimate_usable", "gauge", "1 if the numbers stand.",
           number_at(estimate, "usable"));
  page.one("shaker_estimate_intervals_hold", "gauge", "1 if noise explains the misfit.",
           number_at(estimate, "intervals_hold"));
  page.one("shaker_estimate_cycles", "gauge", "Cycles in it.", number_at(estimate, "cycles_used"));
  page.one("shaker_estimate_gap", "gauge", "Misfit of the mean cycles, in the model's length unit.",
           number_at(estimate, "gap"));
  page.one("shaker_estimate_noise_floor", "gauge", "The part of it that scatter explains.",
           number_at(estimate, "noise_floor"));
}

void add_rig(Page& page, const Feed& feed, const std::string& name) {
  page.of_rig(name);
  page.one("shaker_up", "gauge", "1 if the daemon answers the gateway.",
           feed.connected() ? 1.0 : 0.0);
  if (!feed.connected()) return;  // what is old would look as if it were new
  page.family("shaker_alarms", "gauge", "Alarms that are not yet acknowledged.");
  for (const char* severity : {"error", "warning", "info"})
    page.sample(feed.alarms(severity), {{"severity", severity}});
  if (const Json* version = feed.last("version")) {
    page.family("shaker_build_info", "gauge", "1; the daemon's version and its rig.");
    page.sample(1.0, {{"version", word_at(*version, "version")},
                      {name.empty() ? "rig" : "rig_name", word_at(*version, "rig")}});
  }
  if (const Json* state = feed.last("state")) add_state(page, *state);
  if (const Json* health = feed.last("health")) add_health(page, *health);
  if (const Json* estimate = feed.last("estimate")) add_estimate(page, *estimate);
}

}  // namespace

std::string metrics(const std::vector<RigFeed>& rigs, const GatewayFigures& figures) {
  Page page;
  page.one("shaker_gateway_browsers", "gauge", "Browsers that look on.", figures.browsers);
  page.one("shaker_gateway_given_up_total", "counter", "Browsers that did not read.",
           static_cast<double>(figures.given_up));
  for (const RigFeed& rig : rigs)
    add_rig(page, *rig.feed, rig.name);
  return page.text();
}

}  // namespace shaker::gateway
