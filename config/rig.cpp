#include "config/rig.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/unit.hpp"
#include "config/rig_devices.hpp"
#include "config/rig_registers.hpp"

namespace shaker::config {
namespace {

using protocol::Channel;

// m. The longest dampers, those of bridges, have about 3 m of stroke.
constexpr double kStrokeMax = 5.0;

const std::array<std::string, 5> kActions = {"none", "indicate", "hold", "ramp_down", "stop"};

void read_action(ObjectReader& reader, const std::string& key, Action& action) {
  if (const auto index = reader.choice(key, kActions, false)) {
    action = static_cast<Action>(*index);
  }
}

void read_limits(const Node& node, const std::string& pointer, Findings& findings, Limits& limits) {
  ObjectReader reader(node, pointer, findings);
  reader.optional("stroke_min_m", limits.stroke_min_m, at_least(-kStrokeMax).at_most(kStrokeMax));
  reader.optional("stroke_max_m", limits.stroke_max_m, at_least(-kStrokeMax).at_most(kStrokeMax));
  if (limits.stroke_max_m <= limits.stroke_min_m) {
    reader.complain("stroke_max_m", fmt::format("{} is not above stroke_min_m, which is {}",
                                                limits.stroke_max_m, limits.stroke_min_m));
  } else if (limits.stroke_max_m - limits.stroke_min_m > kStrokeMax) {
    reader.complain(
        "stroke_max_m",
        fmt::format("{} allows a stroke of {} m from stroke_min_m; no damper has more "
                    "than {} m: give the limits of this one",
                    limits.stroke_max_m, limits.stroke_max_m - limits.stroke_min_m, kStrokeMax));
  }
  read_action(reader, "stroke_action", limits.stroke_action);
  reader.optional("stroke_rate_max_m_s", limits.stroke_rate_max_m_s, above(0).at_most(20));
  read_action(reader, "stroke_rate_action", limits.stroke_rate_action);
  reader.optional("excitation_max_m_s2", limits.excitation_max_m_s2, above(0).at_most(1000));
  read_action(reader, "excitation_action", limits.excitation_action);
  reader.optional("frequency_min_hz", limits.frequency_min_hz, above(0).at_most(1000));
  reader.optional("frequency_max_hz", limits.frequency_max_hz, above(0).at_most(1000));
  if (limits.frequency_max_hz < limits.frequency_min_hz) {
    reader.complain("frequency_max_hz",
                    fmt::format("{} is below frequency_min_hz, which is {}",
                                limits.frequency_max_hz, limits.frequency_min_hz));
  }
  reader.optional("stale_s", limits.stale_s, at_least(0.001).at_most(2));
  read_action(reader, "stale_action", limits.stale_action);
  // From 1 on, a table that does not move at all would not be an error.
  reader.optional("command_error_fraction", limits.command_error_fraction, above(0).below(1));
  read_action(reader, "command_error_action", limits.command_error_action);
  reader.optional("response_change_fraction", limits.response_change_fraction,
                  above(0).at_most(10));
  read_action(reader, "response_change_action", limits.response_change_action);
  reader.optional("under_peak_fraction", limits.under_peak_fraction, at_least(0).at_most(1));
  read_action(reader, "under_peak_action", limits.under_peak_action);
  reader.optional("trim_max_fraction", limits.trim_max_fraction, at_least(0).at_most(0.5));
  reader.optional("engine_stall_s", limits.engine_stall_s, at_least(0.05).at_most(2));
  reader.optional("acquisition_stall_s", limits.acquisition_stall_s, at_least(0.1).at_most(5));
  reader.optional("recorder_stall_s", limits.recorder_stall_s, at_least(0.5).at_most(10));
  reader.finish();
}

void check_protection(ObjectReader& reader, const RigConfig& rig) {
  std::vector<std::string> acting;
  for (const Guard& guard : guards(rig.limits)) {
    if (guard.on && ends_motion(guard.action)) acting.emplace_back(guard.key);
  }
  if (acting.empty() && !rig.unprotected) {
    reader.complain("limits",
                    "no detector ends the motion: every action is none, indicate or hold; give at "
                    "least one the action ramp_down or stop, or say \"unprotected\": true beside "
                    "\"limits\"");
  } else if (!acting.empty() && rig.unprotected) {
    reader.complain("unprotected", fmt::format("true is wrong: {} end the motion; leave it out",
                                               fmt::join(acting, ", ")));
  }
}

// The sensors together must give displacement, and each channel once.
void check_channels(ObjectReader& reader, const RigConfig& rig) {
  std::set<Channel> given;
  for (const SensorConfig& sensor : rig.sensors) {
    for (const Channel channel : channels_of(sensor)) {
      if (!given.insert(channel).second) {
        reader.complain("sensors", fmt::format("channel \"{}\" is given twice; leave one out",
                                               protocol::name(channel)));
      }
    }
  }
  if (!given.contains(Channel::displacement)) {
    reader.complain("sensors",
                    "none gives the channel \"displacement\"; the stroke must be "
                    "measured");
  }
}

// A sensor thread that waits for an answer advances no more.
void check_answers(ObjectReader& reader, const RigConfig& rig) {
  for (const SensorConfig& sensor : rig.sensors) {
    const auto* modbus = std::get_if<ModbusSensor>(&sensor);
    if (!modbus || modbus->link.response_timeout_s < rig.limits.acquisition_stall_s) continue;
    reader.complain("sensors",
                    fmt::format("response_timeout_s {} is not below acquisition_stall_s, which is "
                                "{}: one missing answer would stop the exciter",
                                modbus->link.response_timeout_s, rig.limits.acquisition_stall_s));
  }
}

bool is_campaign_replay(const SensorConfig& sensor) {
  const auto* replay = std::get_if<ReplaySensor>(&sensor);
  return replay && replay->signals.empty() && replay->registers.empty();
}

// Every auxiliary channel needs a name: an exported column without one is useless later.
void check_auxiliary(ObjectReader& reader, const RigConfig& rig) {
  std::set<Channel> given;
  bool unknown = false;  // a recorded campaign may contain any channel
  for (const SensorConfig& sensor : rig.sensors) {
    unknown = unknown || is_campaign_replay(sensor);
    for (const Channel channel : channels_of(sensor))
      given.insert(channel);
  }
  for (const Channel channel : given) {
    if (protocol::is_auxiliary(channel) && !rig.auxiliary.contains(channel)) {
      reader.complain("auxiliary",
                      fmt::format("a sensor gives {0}, which has no name and unit here; add "
                                  "\"{0}\": {{\"name\": ..., \"unit\": ...}}",
                                  protocol::name(channel)));
    }
  }
  for (const auto& [channel, label] : rig.auxiliary) {
    if (!unknown && !given.contains(channel)) {
      reader.complain("auxiliary",
                      fmt::format("{} (\"{}\") is given by no sensor; name it in a sensor, or "
                                  "leave it out",
                                  protocol::name(channel), label.name));
    }
  }
}

// Converts each auxiliary channel to the unit of its label.
void convert_auxiliary(ObjectReader& reader, RigConfig& rig) {
  const auto refuse = [&](Channel channel, const std::string& unit, const std::string& wanted,
                          const char* where) {
    reader.complain("auxiliary",
                    fmt::format("{0} is measured in \"{1}\", which cannot be converted into "
                                "\"{2}\"; known are {3}. For another one, give the {4} a scale "
                                "that leads to {2}, and this unit",
                                protocol::name(channel), unit, wanted, units_like(wanted), where));
  };
  const auto convert = [&](auto& registers) {
    for (auto& [channel, spec] : registers) {
      const auto label = rig.auxiliary.find(channel);
      if (label != rig.auxiliary.end() && !to_unit(spec, label->second.unit))
        refuse(channel, spec.unit, label->second.unit, "register");
    }
  };
  const auto want = [&](std::vector<CanSignal>& signals) {
    for (CanSignal& signal : signals) {
      const auto label = rig.auxiliary.find(signal.channel);
      if (label == rig.auxiliary.end()) continue;
      const std::string& wanted = label->second.unit;
      if (signal.scale && !to_unit(*signal.scale, *signal.offset, signal.unit, wanted))
        refuse(signal.channel, signal.unit, wanted, "signal");
      signal.unit = wanted;
    }
  };
  for (SensorConfig& sensor : rig.sensors) {
    if (auto* can = std::get_if<CanSensor>(&sensor)) want(can->signals);
    if (auto* modbus = std::get_if<ModbusSensor>(&sensor)) convert(modbus->registers);
    if (auto* replay = std::get_if<ReplaySensor>(&sensor)) {
      want(replay->signals);
      convert(replay->registers);
    }
  }
}

void check_together(ObjectReader& reader, const RigConfig& rig) {
  bool simulated = false;
  for (const SensorConfig& sensor : rig.sensors) {
    simulated = simulated || std::holds_alternative<SimulatedSensor>(sensor);
  }
  const auto& device = rig.exciter.device;
  if (std::holds_alternative<SimulatedExciter>(device) && !simulated) {
    reader.complain("exciter",
                    "a simulated exciter moves only a simulated sensor; add one, or "
                    "name the real exciter");
  }
  if (simulated && (std::holds_alternative<ModbusExciter>(device) ||
                    std::holds_alternative<CanExciter>(device))) {
    reader.complain("sensors",
                    "a simulated sensor would not see what a real exciter does, and no "
                    "limit would protect the damper; use the real sensor, or the "
                    "simulated exciter");
  }
}

// A name becomes a column of exported files: letters, digits and '_' only, and different from
// the names of the other channels.
void read_auxiliary(const Node& node, Findings& findings, protocol::ChannelLabels& labels) {
  ObjectReader reader(node, "/auxiliary", findings);
  std::set<std::string> names;
  for (int i = 0; i < protocol::kAuxiliaryCount; ++i) {
    const Channel channel = protocol::auxiliary(i);
    const std::string key(protocol::name(channel));
    const Node* entry = reader.member(key, false);
    if (!entry) continue;
    protocol::ChannelLabel label;
    ObjectReader inner(*entry, reader.at(key), findings);
    inner.required("name", label.name);
    inner.required("unit", label.unit);
    inner.finish();
    const bool plain = label.name.size() <= 40 && std::ranges::all_of(label.name, [](char c) {
                         return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
                       });
    if (!plain) {
      inner.complain("name", fmt::format("\"{}\" is no name of a channel; up to 40 letters, digits "
                                         "and '_' are allowed, such as gas_pressure",
                                         label.name));
    } else if (protocol::channel_from_name(label.name).value_or(channel) != channel ||
               !names.insert(label.name).second) {
      inner.complain(
          "name", fmt::format("\"{}\" is another channel's name; choose an own one", label.name));
    }
    if (label.unit.size() > 20 || label.unit.find_first_of(",\"\n\r") != std::string::npos) {
      inner.complain("unit", fmt::format("\"{}\" is no unit; up to 20 characters without comma and "
                                         "quotation mark are allowed, such as kPa",
                                         label.unit));
    }
    labels.emplace(channel, std::move(label));
  }
  reader.finish();
}

}  // namespace

std::vector<Guard> guards(const Limits& limits) {
  return {{"stroke_action", limits.stroke_action, true},
          {"stroke_rate_action", limits.stroke_rate_action, true},
          {"excitation_action", limits.excitation_action, true},
          {"stale_action", limits.stale_action, true},
          {"command_error_action", limits.command_error_action, true},
          {"response_change_action", limits.response_change_action, true},
          {"under_peak_action", limits.under_peak_action, limits.under_peak_fraction > 0.0}};
}

std::vector<Channel> channels_of(const SensorConfig& sensor) {
  std::vector<Channel> out;
  const auto* replay = std::get_if<ReplaySensor>(&sensor);
  if (const auto* can = std::get_if<CanSensor>(&sensor)) {
    for (const CanSignal& signal : can->signals)
      out.push_back(signal.channel);
  } else if (const auto* modbus = std::get_if<ModbusSensor>(&sensor)) {
    for (const auto& [channel, spec] : modbus->registers)
      out.push_back(channel);
  } else if (replay && !replay->signals.empty()) {
    for (const CanSignal& signal : replay->signals)
      out.push_back(signal.channel);
  } else if (replay && !replay->registers.empty()) {
    for (const auto& [channel, spec] : replay->registers)
      out.push_back(channel);
  } else {
    out = {Channel::displacement, Channel::excitation};
    if (const auto* simulated = std::get_if<SimulatedSensor>(&sensor)) {
      for (const auto& [channel, quantity] : simulated->auxiliary)
        out.push_back(channel);
    }
  }
  return out;
}

Result<RigConfig> parse_rig(const std::string& text, const std::string& origin) {
  const auto root = parse_json(text, origin);
  if (!root) return root.error();
  RigConfig rig;
  rig.text = text;
  rig.exciter.device = SimulatedExciter{};
  Findings findings(origin);
  ObjectReader reader(*root, "", findings);
  reader.format("shaker-rig/1");
  reader.required("name", rig.name);
  reader.optional("model", rig.model);
  if (const Node* node = reader.member("exciter", true)) {
    read_exciter(*node, "/exciter", findings, rig.exciter);
  }
  bool sensors_good = true;
  reader.array("sensors", true, 1, [&](const Node& node, const std::string& pointer) {
    auto sensor = read_sensor(node, pointer, findings);
    sensors_good = sensors_good && sensor.has_value();
    if (sensor) rig.sensors.push_back(std::move(*sensor));
  });
  if (const Node* node = reader.member("auxiliary", false)) {
    read_auxiliary(*node, findings, rig.auxiliary);
  }
  if (const Node* node = reader.member("limits", false)) {
    read_limits(*node, "/limits", findings, rig.limits);
  }
  if (const Node* node = reader.member("calibration", false))
    read_calibrations(*node, "/calibration", findings, rig.auxiliary, rig.calibration);
  reader.optional("unprotected", rig.unprotected);
  reader.optional("client_lease_s", rig.client_lease_s, at_least(0.1).at_most(60));
  reader.finish();
  // Checks across several parts need valid parts.
  if (findings.empty() && sensors_good) {
    check_channels(reader, rig);
    check_answers(reader, rig);
    check_auxiliary(reader, rig);
    convert_auxiliary(reader, rig);
    check_together(reader, rig);
    check_protection(reader, rig);
  }
  if (!findings.empty()) return findings.error();
  return rig;
}

Result<RigConfig> load_rig(const std::filesystem::path& file) {
  const auto text = read_text(file);
  if (!text) return text.error();
  auto rig = parse_rig(*text, file.string());
  if (rig) rig->directory = file.parent_path();
  return rig;
}

}  // namespace shaker::config
