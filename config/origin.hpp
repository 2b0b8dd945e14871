// What a number depends on besides the rig's settings: the specimen that is tested (campaign file)
// and the calibration of each sensor (rig file). They are kept with the measurement; nothing is
// computed from them.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "config/object_reader.hpp"
#include "protocol/channel.hpp"

namespace shaker::config {

// All members may be empty. `charge` (of the gas) and `temperature` are a number and a unit, such
// as "60 bar" and "21 degC".
struct Specimen {
  std::string name, serial, charge, oil, temperature, notes;
};

// The members that are not empty: key and text.
std::vector<std::pair<std::string, std::string>> entries(const Specimen& specimen);
// Sets one member. An Error names an unknown key, or a text that is no quantity.
Result<void> set_entry(Specimen& specimen, std::string_view key, const std::string& text);
void read_specimen(const Node& node, const std::string& pointer, Findings& findings,
                   Specimen& specimen);

// Of a sensor, from its certificate. Dates are "2026-03-01".
struct Calibration {
  std::string sensor, serial;  // kind of sensor (may be empty), and its serial number
  std::string date, due;
  double uncertainty = 0.0;  // expanded (k = 2), in `unit`
  std::string unit;          // the channel's: SI, or that of its label
};
using Calibrations = std::map<protocol::Channel, Calibration>;

void read_calibrations(const Node& node, const std::string& pointer, Findings& findings,
                       const protocol::ChannelLabels& labels, Calibrations& calibrations);

}  // namespace shaker::config
