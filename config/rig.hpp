// The rig file: the devices, their addresses, and the limits that keep damper and people safe.
// JSON with comments; schema in config/schema/rig.schema.json; complete examples in
// config/examples/. Units are SI. Unknown keys are errors.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/result.hpp"
#include "config/origin.hpp"
#include "protocol/channel.hpp"
#include "protocol/modbus/register.hpp"

namespace shaker::config {

struct ModbusTcp {
  std::string host = "127.0.0.1";
  int port = 502;
};
struct ModbusRtu {
  std::string device;  // e.g. /dev/ttyUSB0
  int baud = 19200;
  char parity = 'E';  // N, E or O
  int stop_bits = 1;
};
struct ModbusLink {
  std::variant<ModbusTcp, ModbusRtu> transport;
  int unit_id = 1;
  double response_timeout_s = 0.1;
  double pause_after_connect_s = 0.0;  // some devices need it
  double reconnect_s = 1.0;            // first pause before reconnecting; doubles up to 30 s
  int timeouts_before_close = 3;
};

// Roles in the exciter's register map:
//   frequency (Hz), amplitude (m/s^2), enable (0/1), ramp (s), heartbeat (counter), status, fault;
//   optional: frequency_actual, amplitude_actual, heartbeat_timeout (s: the drive's own reaction to
//   a lost link, read back by the pre-run check), fault_reset (1 clears a fault; written when the
//   operator acknowledges).
struct ModbusExciter {
  ModbusLink link;
  std::map<std::string, protocol::modbus::RegisterSpec> registers;  // by role
  std::uint32_t status_running = 0x0001;  // mask in `status`: motion is on
  std::uint32_t status_ready = 0x0002;    // mask: enabled without a fault
};
// Cyclic setpoint frames from the kernel's broadcast manager, which end by themselves if the
// process hangs (PRACTICE: never unlimited cyclic sending).
struct CanExciter {
  std::string interface = "can0";
  std::filesystem::path dbc;
  std::string setpoint_message;  // with signals named frequency, amplitude, enable, ramp, heartbeat
  std::string status_message;    // with signals named status, fault (frequency, amplitude optional)
  double period_s = 0.02;
  std::uint32_t status_running = 0x0001;
  std::uint32_t status_ready = 0x0002;
};
struct SimulatedExciter {};  // the virtual rig in this process (drivers/sim)
struct ReplayExciter {};     // accepts every setpoint and moves nothing (drivers/replay)

struct ExciterConfig {
  std::variant<ModbusExciter, CanExciter, SimulatedExciter, ReplayExciter> device;
  double heartbeat_period_s = 0.1;  // at most a third of deadman_max_s
  double deadman_max_s = 1.0;       // the drive must stop within this time of a lost link
  double ramp_s = 2.0;              // from zero to the setpoint, and back
};

struct CanSignal {
  protocol::Channel channel = protocol::Channel::displacement;
  std::string message;
  std::string signal;
  // Conversion to `unit`: value * scale + offset, after the scaling of the DBC. If the file gives
  // neither, nor a unit, the unit in the DBC determines the conversion.
  std::optional<double> scale{}, offset{};
  std::string unit{};  // required unit; empty: the channel's SI unit
};
struct CanOpen {
  int node_id = 1;
  bool start_node = true;      // send NMT start, and again after a boot-up message
  double sync_period_s = 0.0;  // 0: another node sends SYNC
};
struct CanSensor {
  std::string interface = "can0";
  std::filesystem::path dbc;  // relative to the rig file
  std::vector<CanSignal> signals;
  bool fd = false;
  std::optional<CanOpen> canopen;
};
struct ModbusSensor {
  ModbusLink link;
  std::map<protocol::Channel, protocol::modbus::RegisterSpec> registers;
  // The device's own clock at the time of the sample. It wraps: u16 or u32, unit us, ms or s.
  // It must be in the same block of registers as the channels.
  std::optional<protocol::modbus::RegisterSpec> timestamp;
  double rate_hz = 100.0;
  std::filesystem::path record_to;  // log of every poll, for a replay; empty: none
};
struct SimulatedSensor {
  double rate_hz = 1000.0;
  std::string plant = "oleo";                // see sim/README.md
  std::map<std::string, double> parameters;  // true values of the plant, by name
  double noise_m = 2e-5;                     // standard deviation of the displacement channel
  double noise_m_s2 = 5e-3;                  // of the excitation channel
  double quantum_m = 1e-6;
  double clock_offset_ppm = 0.0;
  double jitter_fraction = 0.0;   // of one sample
  double dropout_fraction = 0.0;  // part of lost samples
  std::uint64_t seed = 1;
  std::map<protocol::Channel, std::string> auxiliary;  // quantity of the rig, see sim/README.md
};
struct ReplaySensor {
  // A campaign database, a candump -l log (with dbc and signals), or a log of Modbus polls
  // (with the registers of the sensor).
  std::filesystem::path file;
  std::filesystem::path dbc;
  std::vector<CanSignal> signals;
  std::map<protocol::Channel, protocol::modbus::RegisterSpec> registers;
  std::optional<protocol::modbus::RegisterSpec> timestamp;
  double speed = 0.0;  // 0: as fast as it is read; 1: the original speed
};
using SensorConfig = std::variant<CanSensor, ModbusSensor, SimulatedSensor, ReplaySensor>;

// Reaction of a detector that trips (docs/operator.md).
enum class Action { none, indicate, hold, ramp_down, stop };

struct Limits {
  double stroke_min_m = 0.0, stroke_max_m = 0.3;  // outside: stroke_action
  Action stroke_action = Action::stop;
  double stroke_rate_max_m_s = 3.0;
  Action stroke_rate_action = Action::stop;
  double excitation_max_m_s2 = 15.0;  // larger setpoints are refused; measured: action
  Action excitation_action = Action::ramp_down;
  double frequency_min_hz = 0.2, frequency_max_hz = 10.0;  // setpoints outside are refused
  double stale_s = 0.05;                                   // longest time without a good sample
  Action stale_action = Action::ramp_down;
  double command_error_fraction = 0.2;  // of the measured from the commanded amplitude
  Action command_error_action = Action::ramp_down;
  double response_change_fraction = 0.4;  // of the stroke's response, between periods
  Action response_change_action = Action::ramp_down;
  double under_peak_fraction = 0.0;  // 0: off
  Action under_peak_action = Action::indicate;
  // Largest correction of the ordered amplitude, so that the table does what is asked for; 0: off.
  double trim_max_fraction = 0.25;
  // Longest time for which the threads that supervise the table may stand still, s; after it
  // the exciter is stopped at once.
  double engine_stall_s = 0.2, acquisition_stall_s = 0.5, recorder_stall_s = 2.0;
};

// True if the action brings the table to rest.
constexpr bool ends_motion(Action action) {
  return action == Action::ramp_down || action == Action::stop;
}
// A detector of the limits, by the key of its action; `on` is false if its limit switches it
// off.
struct Guard {
  const char* key;
  Action action;
  bool on;
};
std::vector<Guard> guards(const Limits& limits);

struct RigConfig {
  std::string name;
  std::string model;  // path of the default model file, may be empty
  ExciterConfig exciter;
  std::vector<SensorConfig>
      sensors;  // together they give displacement; excitation if it is measured
  // Names and units of all auxiliary channels that the sensors give.
  protocol::ChannelLabels auxiliary;
  Limits limits;
  // No detector ends the motion, and the file states that this is intended. Every view shows
  // it.
  bool unprotected = false;
  double client_lease_s = 2.0;
  std::filesystem::path directory;  // of the rig file: start of its relative paths
  Calibrations calibration;         // of the sensors, as far as the file states it
  std::string text;                 // of the file
};

// The channels that a sensor gives. For a recorded campaign its actual channels are unknown
// here; displacement and excitation are assumed.
std::vector<protocol::Channel> channels_of(const SensorConfig& sensor);

// An Error names the file, line or JSON pointer, the value and the allowed values.
Result<RigConfig> load_rig(const std::filesystem::path& file);
Result<RigConfig> parse_rig(const std::string& text, const std::string& origin);

}  // namespace shaker::config
