#include "config/rig.hpp"

#include <array>
#include <set>

#include <fmt/format.h>

#include "config/rig_devices.hpp"

namespace shaker::config {
namespace {

using protocol::Channel;

const std::array<std::string, 5> kActions = {"none", "indicate", "hold", "ramp_down", "stop"};

void read_action(ObjectReader& reader, const std::string& key, Action& action) {
  if (const auto index = reader.choice(key, kActions, false)) {
    action = static_cast<Action>(*index);
  }
}

void read_limits(const Node& node, const std::string& pointer, Findings& findings, Limits& limits) {
  ObjectReader reader(node, pointer, findings);
  reader.optional("stroke_min_m", limits.stroke_min_m, at_least(-10).at_most(10));
  reader.optional("stroke_max_m", limits.stroke_max_m, at_least(-10).at_most(10));
  if (limits.stroke_max_m <= limits.stroke_min_m) {
    reader.complain("stroke_max_m", fmt::format("{} is not above stroke_min_m, which is {}",
                                                limits.stroke_max_m, limits.stroke_min_m));
  }
  read_action(reader, "stroke_action", limits.stroke_action);
  reader.optional("stroke_rate_max_m_s", limits.stroke_rate_max_m_s, above(0).at_most(100));
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
  reader.optional("stale_s", limits.stale_s, at_least(0.001).at_most(10));
  read_action(reader, "stale_action", limits.stale_action);
  reader.optional("command_error_fraction", limits.command_error_fraction, above(0).at_most(10));
  read_action(reader, "command_error_action", limits.command_error_action);
  reader.optional("under_peak_fraction", limits.under_peak_fraction, at_least(0).at_most(1));
  read_action(reader, "under_peak_action", limits.under_peak_action);
  reader.finish();
}

std::vector<Channel> channels(const SensorConfig& sensor) {
  std::vector<Channel> out;
  if (const auto* can = std::get_if<CanSensor>(&sensor)) {
    for (const CanSignal& signal : can->signals)
      out.push_back(signal.channel);
  } else if (const auto* modbus = std::get_if<ModbusSensor>(&sensor)) {
    for (const auto& [channel, spec] : modbus->registers)
      out.push_back(channel);
  } else if (const auto* replay = std::get_if<ReplaySensor>(&sensor);
             replay && !replay->signals.empty()) {
    for (const CanSignal& signal : replay->signals)
      out.push_back(signal.channel);
  } else {
    out = {Channel::displacement, Channel::excitation};
  }
  return out;
}

// Together the sensors must give displacement, and each channel once.
void check_channels(ObjectReader& reader, const RigConfig& rig) {
  std::set<Channel> given;
  for (const SensorConfig& sensor : rig.sensors) {
    for (const Channel channel : channels(sensor)) {
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

}  // namespace

Result<RigConfig> parse_rig(const std::string& text, const std::string& origin) {
  const auto root = parse_json(text, origin);
  if (!root) return root.error();
  RigConfig rig;
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
  if (const Node* node = reader.member("limits", false)) {
    read_limits(*node, "/limits", findings, rig.limits);
  }
  reader.optional("client_lease_s", rig.client_lease_s, at_least(0.1).at_most(60));
  reader.finish();
  // What concerns several parts is judged only when each part is good.
  if (findings.empty() && sensors_good) {
    check_channels(reader, rig);
    check_together(reader, rig);
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
