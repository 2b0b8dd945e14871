#include "config/rig_devices.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/rig_registers.hpp"

namespace shaker::config {
namespace {

using protocol::Channel;

// The names of an enum's values, in order.
const std::array<std::string, 2> kTransports = {"tcp", "rtu"};
const std::array<std::string, 3> kParities = {"N", "E", "O"};
const std::array<std::string, 4> kExciters = {"modbus", "can", "simulated", "replay"};
const std::array<std::string, 4> kSensors = {"can", "modbus", "simulated", "replay"};
// Every channel's name, in the order of the enum.
const std::vector<std::string> kChannels = [] {
  std::vector<std::string> names;
  for (int i = 0; i < protocol::kChannelCount; ++i)
    names.emplace_back(protocol::name(static_cast<Channel>(i)));
  return names;
}();

const std::array<std::string, 11> kRoles = {"frequency",
                                            "amplitude",
                                            "enable",
                                            "ramp",
                                            "heartbeat",
                                            "status",
                                            "fault",
                                            "frequency_actual",
                                            "amplitude_actual",
                                            "heartbeat_timeout",
                                            "fault_reset"};
constexpr std::size_t kWrittenRoles = 5;   // the first five are written: not in the input table
constexpr std::size_t kRequiredRoles = 7;  // the first seven are required

constexpr double kBeatsWithinDeadman = 3.0;

const std::array<int, 10> kBauds = {1200,  2400,  4800,   9600,   19200,
                                    38400, 57600, 115200, 230400, 460800};

// The unit of a role of the exciter's map; empty: a number without unit, or bits.
std::string_view unit_of_role(std::string_view role) {
  if (role.starts_with("frequency")) return "Hz";
  if (role.starts_with("amplitude")) return "m/s^2";
  return role == "ramp" || role == "heartbeat_timeout" ? "s" : "";
}

// Checks the masks of "running" and "ready" against a status of `bits` bits.
void check_masks(ObjectReader& reader, std::uint32_t running, std::uint32_t ready, int bits) {
  const auto check = [&](const char* key, std::uint32_t mask) {
    if (mask == 0) {
      reader.complain(key, "0 selects no bit, so the status would say nothing; name the bits");
    } else if (bits < 32 && mask >> bits != 0) {
      reader.complain(key, fmt::format("{} has bits beyond the {} bits of the register \"status\"",
                                       mask, bits));
    }
  };
  check("status_running", running);
  check("status_ready", ready);
  if (running == ready) {
    reader.complain("status_ready", fmt::format("{} is status_running as well; an exciter that is "
                                                "ready and one that runs must be told apart",
                                                ready));
  }
}

void read_tcp(ObjectReader& reader, ModbusTcp& tcp) {
  reader.required("host", tcp.host);
  reader.optional("port", tcp.port, at_least(1).at_most(65535));
}

void read_rtu(ObjectReader& reader, ModbusRtu& rtu) {
  reader.required("device", rtu.device);
  reader.optional("baud", rtu.baud, above(0));
  if (std::find(kBauds.begin(), kBauds.end(), rtu.baud) == kBauds.end()) {
    reader.complain("baud", fmt::format("{} is no common rate; allowed are {}", rtu.baud,
                                        fmt::join(kBauds, ", ")));
  }
  if (const auto parity = reader.choice("parity", kParities, false)) {
    rtu.parity = kParities[*parity][0];
  }
  reader.optional("stop_bits", rtu.stop_bits, at_least(1).at_most(2));
}

void read_link(ObjectReader& parent, Findings& findings, ModbusLink& link) {
  const Node* node = parent.member("link", true);
  if (!node) return;
  ObjectReader reader(*node, parent.at("link"), findings);
  if (const Node* transport = reader.member("transport", true)) {
    ObjectReader inner(*transport, reader.at("transport"), findings);
    const auto kind = inner.choice("kind", kTransports, true);
    if (kind == 0u) read_tcp(inner, link.transport.emplace<ModbusTcp>());
    if (kind == 1u) read_rtu(inner, link.transport.emplace<ModbusRtu>());
    if (kind) inner.finish();
  }
  reader.optional("unit_id", link.unit_id, at_least(0).at_most(255));
  if (std::holds_alternative<ModbusRtu>(link.transport) &&
      (link.unit_id < 1 || link.unit_id > 247)) {
    reader.complain("unit_id", fmt::format("{} is out of range on a serial line; at least 1 and at "
                                           "most 247 is allowed",
                                           link.unit_id));
  }
  reader.optional("response_timeout_s", link.response_timeout_s, at_least(0.001).at_most(10));
  reader.optional("pause_after_connect_s", link.pause_after_connect_s, at_least(0).at_most(10));
  reader.optional("reconnect_s", link.reconnect_s, at_least(0.01).at_most(30));
  reader.optional("timeouts_before_close", link.timeouts_before_close, at_least(1).at_most(100));
  reader.finish();
}

void read_modbus_exciter(ObjectReader& reader, Findings& findings, ModbusExciter& exciter) {
  read_link(reader, findings, exciter.link);
  reader.optional("status_running", exciter.status_running);
  reader.optional("status_ready", exciter.status_ready);
  const Node* map = reader.member("registers", true);
  if (!map) return;
  ObjectReader roles(*map, reader.at("registers"), findings);
  for (std::size_t i = 0; i < kRoles.size(); ++i) {
    const Node* node = roles.member(kRoles[i], i < kRequiredRoles);
    if (!node) continue;
    RegisterSpec spec = read_register(*node, roles.at(kRoles[i]), findings);
    convert(spec, unit_of_role(kRoles[i]), ObjectReader(*node, roles.at(kRoles[i]), findings));
    const bool written = i < kWrittenRoles || kRoles[i] == "fault_reset";
    if (written && spec.table == protocol::modbus::RegisterTable::input) {
      roles.complain(kRoles[i], "input registers cannot be written; use the table \"holding\"");
    }
    exciter.registers.emplace(kRoles[i], spec);
  }
  complain_of_overlaps(roles, exciter.registers);
  roles.finish();
  const auto status = exciter.registers.find("status");
  check_masks(reader, exciter.status_running, exciter.status_ready,
              status == exciter.registers.end() ? 32 : 16 * words(status->second));
}

// IFNAMSIZ leaves 15 bytes for a network interface's name.
void read_interface(ObjectReader& reader, std::string& interface) {
  reader.optional("interface", interface);
  if (interface.empty() || interface.size() > 15 || interface.find('/') != std::string::npos) {
    reader.complain("interface", fmt::format("\"{}\" is no interface name; 1 to 15 characters "
                                             "without '/' are allowed, such as can0",
                                             interface));
  }
}

void read_can_exciter(ObjectReader& reader, CanExciter& exciter) {
  read_interface(reader, exciter.interface);
  reader.required("dbc", exciter.dbc);
  reader.required("setpoint_message", exciter.setpoint_message);
  reader.required("status_message", exciter.status_message);
  reader.optional("period_s", exciter.period_s, at_least(0.001).at_most(1));
  reader.optional("status_running", exciter.status_running);
  reader.optional("status_ready", exciter.status_ready);
  check_masks(reader, exciter.status_running, exciter.status_ready, 32);  // the DBC gives the width
}

// A scale beside the unit of a DBC file replaces it, so the rig file states the unit that the
// scale leads to. Scale and offset lead to SI afterwards; those of an auxiliary channel are
// converted to the unit of its label, when that is read.
void read_signal_scale(ObjectReader& reader, CanSignal& signal) {
  reader.optional("scale", signal.scale);
  if (signal.scale && *signal.scale == 0.0) {
    reader.complain("scale", "0 would lose every value; leave it out for 1");
  }
  reader.optional("offset", signal.offset);
  reader.optional("unit", signal.unit);
  if (!signal.scale && !signal.offset && signal.unit.empty()) return;
  const std::string_view wanted = protocol::unit(signal.channel);
  if (signal.unit.empty()) {
    reader.complain("unit",
                    fmt::format("is missing beside \"{}\": give the unit of value * scale + "
                                "offset, such as \"{}\"",
                                signal.scale ? "scale" : "offset", wanted.empty() ? "Pa" : wanted));
    return;
  }
  signal.scale = signal.scale.value_or(1.0);
  signal.offset = signal.offset.value_or(0.0);
  if (wanted.empty() || to_unit(*signal.scale, *signal.offset, signal.unit, wanted)) return;
  complain_of_unit(reader, signal.unit, wanted);
}

std::vector<CanSignal> read_signals(ObjectReader& reader, Findings& findings, bool required) {
  std::vector<CanSignal> signals;
  reader.array("signals", required, 1, [&](const Node& node, const std::string& pointer) {
    CanSignal signal;
    ObjectReader inner(node, pointer, findings);
    if (const auto channel = inner.choice("channel", kChannels, true)) {
      signal.channel = static_cast<Channel>(*channel);
    }
    inner.required("message", signal.message);
    inner.required("signal", signal.signal);
    read_signal_scale(inner, signal);
    inner.finish();
    signals.push_back(std::move(signal));
  });
  return signals;
}

CanSensor read_can_sensor(ObjectReader& reader, Findings& findings) {
  CanSensor sensor;
  read_interface(reader, sensor.interface);
  reader.required("dbc", sensor.dbc);
  sensor.signals = read_signals(reader, findings, true);
  reader.optional("fd", sensor.fd);
  if (const Node* node = reader.member("canopen", false)) {
    CanOpen canopen;
    ObjectReader inner(*node, reader.at("canopen"), findings);
    inner.optional("node_id", canopen.node_id, at_least(1).at_most(127));
    inner.optional("start_node", canopen.start_node);
    inner.optional("sync_period_s", canopen.sync_period_s, at_least(0).at_most(10));
    inner.finish();
    sensor.canopen = canopen;
  }
  return sensor;
}

// Reads the map of a Modbus sensor or of its log; `sensor` has registers and timestamp.
template <class SensorWithRegisters>
void read_sensor_registers(ObjectReader& reader, Findings& findings, bool required,
                           SensorWithRegisters& sensor) {
  const Node* map = reader.member("registers", required);
  if (!map) return;
  ObjectReader channels(*map, reader.at("registers"), findings);
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    if (const Node* node = channels.member(kChannels[i], false)) {
      const auto channel = static_cast<Channel>(i);
      RegisterSpec spec = read_register(*node, channels.at(kChannels[i]), findings);
      convert(spec, protocol::unit(channel),
              ObjectReader(*node, channels.at(kChannels[i]), findings));
      sensor.registers.emplace(channel, spec);
    }
  }
  std::map<std::string, RegisterSpec> all;
  for (const auto& [channel, spec] : sensor.registers)
    all.emplace(protocol::name(channel), spec);
  if (const Node* node = channels.member("timestamp", false)) {
    sensor.timestamp = read_timestamp(*node, channels.at("timestamp"), findings);
    all.emplace("timestamp", *sensor.timestamp);
  }
  complain_of_overlaps(channels, all);
  channels.finish();
}

ModbusSensor read_modbus_sensor(ObjectReader& reader, Findings& findings) {
  ModbusSensor sensor;
  read_link(reader, findings, sensor.link);
  reader.optional("rate_hz", sensor.rate_hz, above(0).at_most(10000));
  reader.optional("record_to", sensor.record_to);
  read_sensor_registers(reader, findings, true, sensor);
  return sensor;
}

SimulatedSensor read_simulated_sensor(ObjectReader& reader, Findings& findings) {
  SimulatedSensor sensor;
  reader.optional("rate_hz", sensor.rate_hz, above(0).at_most(100000));
  reader.optional("plant", sensor.plant);
  if (const Node* node = reader.member("parameters", false)) {
    ObjectReader inner(*node, reader.at("parameters"), findings);
    for (const std::string& key : node->keys) {
      double value = 0.0;
      inner.required(key, value);
      sensor.parameters.emplace(key, value);
    }
  }
  reader.optional("noise_m", sensor.noise_m, at_least(0));
  reader.optional("noise_m_s2", sensor.noise_m_s2, at_least(0));
  reader.optional("quantum_m", sensor.quantum_m, at_least(0));
  reader.optional("clock_offset_ppm", sensor.clock_offset_ppm, at_least(-10000).at_most(10000));
  reader.optional("jitter_fraction", sensor.jitter_fraction, at_least(0).below(1));
  reader.optional("dropout_fraction", sensor.dropout_fraction, at_least(0).below(1));
  reader.optional("seed", sensor.seed);
  if (const Node* node = reader.member("auxiliary", false)) {
    ObjectReader inner(*node, reader.at("auxiliary"), findings);
    for (int i = 0; i < protocol::kAuxiliaryCount; ++i) {
      const std::string key(protocol::name(protocol::auxiliary(i)));
      std::string quantity;
      if (inner.member(key, false)) {
        inner.required(key, quantity);
        sensor.auxiliary.emplace(protocol::auxiliary(i), quantity);
      }
    }
    inner.finish();
  }
  return sensor;
}

ReplaySensor read_replay_sensor(ObjectReader& reader, Findings& findings) {
  ReplaySensor sensor;
  reader.required("file", sensor.file);
  reader.optional("dbc", sensor.dbc);
  sensor.signals = read_signals(reader, findings, false);
  read_sensor_registers(reader, findings, false, sensor);
  reader.optional("speed", sensor.speed, at_least(0).at_most(1000));
  if (!sensor.registers.empty() && !sensor.signals.empty()) {
    reader.complain("registers",
                    "a log is of CAN frames (\"dbc\" and \"signals\") or of Modbus "
                    "polls (\"registers\"), not of both");
  }
  if (sensor.dbc.empty() != sensor.signals.empty()) {
    reader.complain(sensor.dbc.empty() ? "signals" : "dbc",
                    "a CAN log wants both \"dbc\" and \"signals\", any other recording neither");
  }
  return sensor;
}

// A drive stops by itself within deadman_max_s of a lost link. Heartbeats must be much more
// frequent, and anything that can delay a stop must be shorter.
void check_times(ObjectReader& reader, const ExciterConfig& exciter, Findings& findings) {
  const double longest = exciter.deadman_max_s;
  const double third = longest / kBeatsWithinDeadman;
  if (exciter.heartbeat_period_s > third * (1.0 + 1e-9)) {
    reader.complain("heartbeat_period_s",
                    fmt::format("{} is more than a third of deadman_max_s, which is {}: one lost "
                                "heartbeat would stop the drive; at most {:.3g} is allowed",
                                exciter.heartbeat_period_s, longest, third));
  }
  const Node* device = reader.node().find("device");
  if (const auto* can = std::get_if<CanExciter>(&exciter.device); device && can) {
    if (can->period_s > third * (1.0 + 1e-9)) {
      ObjectReader(*device, reader.at("device"), findings)
          .complain("period_s", fmt::format("{} is more than a third of deadman_max_s, which is "
                                            "{}; at most {:.3g} is allowed",
                                            can->period_s, longest, third));
    }
  }
  const Node* link = device ? device->find("link") : nullptr;
  const auto* modbus = std::get_if<ModbusExciter>(&exciter.device);
  if (link && modbus && modbus->link.response_timeout_s >= longest) {
    ObjectReader(*link, reader.at("device") + "/link", findings)
        .complain("response_timeout_s",
                  fmt::format("{} is not below deadman_max_s, which is {}: a stop behind a missing "
                              "answer would come too late",
                              modbus->link.response_timeout_s, longest));
  }
}

}  // namespace

void read_exciter(const Node& node, const std::string& pointer, Findings& findings,
                  ExciterConfig& exciter) {
  ObjectReader reader(node, pointer, findings);
  reader.optional("heartbeat_period_s", exciter.heartbeat_period_s, at_least(0.005).at_most(5));
  reader.optional("deadman_max_s", exciter.deadman_max_s, at_least(0.05).at_most(5));
  reader.optional("ramp_s", exciter.ramp_s, at_least(0).at_most(600));
  if (const Node* device = reader.member("device", true)) {
    ObjectReader inner(*device, reader.at("device"), findings);
    const auto kind = inner.choice("kind", kExciters, true);
    if (kind == 0u) read_modbus_exciter(inner, findings, exciter.device.emplace<ModbusExciter>());
    if (kind == 1u) read_can_exciter(inner, exciter.device.emplace<CanExciter>());
    if (kind == 2u) exciter.device.emplace<SimulatedExciter>();
    if (kind == 3u) exciter.device.emplace<ReplayExciter>();
    if (kind) inner.finish();
  }
  reader.finish();
  check_times(reader, exciter, findings);
}

std::optional<SensorConfig> read_sensor(const Node& node, const std::string& pointer,
                                        Findings& findings) {
  ObjectReader reader(node, pointer, findings);
  const auto kind = reader.choice("kind", kSensors, true);
  if (!kind) return std::nullopt;
  SensorConfig sensor;
  switch (*kind) {
    case 0:
      sensor = read_can_sensor(reader, findings);
      break;
    case 1:
      sensor = read_modbus_sensor(reader, findings);
      break;
    case 2:
      sensor = read_simulated_sensor(reader, findings);
      break;
    default:
      sensor = read_replay_sensor(reader, findings);
      break;
  }
  reader.finish();
  return sensor;
}

}  // namespace shaker::config
