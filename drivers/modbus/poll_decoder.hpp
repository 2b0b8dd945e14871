// Converts the registers of one poll to samples, for a device and for a log of it alike.
//
// One thread; decode() does not allocate.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/modbus/device_clock.hpp"
#include "drivers/modbus/register_set.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::modbus {

class PollDecoder {
 public:
  // An Error names the invalid register.
  static Result<PollDecoder> make(
      const std::map<protocol::Channel, protocol::modbus::RegisterSpec>& registers,
      const std::optional<protocol::modbus::RegisterSpec>& timestamp);

  const std::vector<protocol::Channel>& channels() const { return channels_; }
  bool stamped() const { return device_clock_.has_value(); }
  RegisterSet& registers() { return registers_; }
  void restart();  // a new connection

  // Decodes the registers as last read: requested at `asked`, received at `received`. Returns 0
  // if the device has taken no sample since. Precondition: out.size() >= channels().size().
  std::size_t decode(Nanoseconds asked, Nanoseconds received, std::span<Sample> out);

 private:
  PollDecoder(std::vector<protocol::Channel> channels,
              std::vector<protocol::modbus::RegisterSpec> specs,
              std::optional<DeviceClock> device_clock)
      : channels_(std::move(channels)),
        registers_(std::move(specs)),
        device_clock_(std::move(device_clock)) {}

  std::vector<protocol::Channel> channels_;
  RegisterSet registers_;                    // the channels, then the time stamp
  std::optional<DeviceClock> device_clock_;  // if there is a time stamp
};

}  // namespace shaker::drivers::modbus
